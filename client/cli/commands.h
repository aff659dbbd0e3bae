// The commands of `drape`, one .cpp file each: a function that adds the command to the program and
// stores in `action` what the command does when it is called.
#pragma once

#include <CLI/CLI.hpp>

#include <functional>

namespace drape::cli {

// Exit codes of the program.
inline constexpr int kDone = 0;
inline constexpr int kFailed = 1;
inline constexpr int kUsage = 2;
inline constexpr int kFaulted = 3;  // all was done, but a cloth is faulted

// Runs the chosen command after the parse; returns the exit code. Throws drape::Error.
using Action = std::function<int()>;

void AddRun(CLI::App& app, Action& action);
void AddDemo(CLI::App& app, Action& action);
void AddInfo(CLI::App& app, Action& action);
void AddHealth(CLI::App& app, Action& action);
void AddCreate(CLI::App& app, Action& action);
void AddStep(CLI::App& app, Action& action);
void AddRead(CLI::App& app, Action& action);
void AddRender(CLI::App& app, Action& action);
void AddWatch(CLI::App& app, Action& action);
void AddLoad(CLI::App& app, Action& action);
void AddList(CLI::App& app, Action& action);
void AddDelete(CLI::App& app, Action& action);
void AddSnapshot(CLI::App& app, Action& action);
void AddRestore(CLI::App& app, Action& action);
void AddAdmin(CLI::App& app, Action& action);

// The whole program: parses, acts, prints errors to stderr. Returns the exit code.
int Main(int argc, const char* const* argv);

}  // namespace drape::cli
