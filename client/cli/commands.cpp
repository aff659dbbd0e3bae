#include "client/cli/commands.h"

#include <algorithm>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "drape/error.h"

namespace drape::cli {
namespace {

bool IsCommand(const CLI::App& app, const std::string& name) {
  const std::vector<const CLI::App*> commands = app.get_subcommands(/*filter=*/{});
  return std::any_of(commands.begin(), commands.end(),
                     [&](const CLI::App* command) { return command->get_name() == name; });
}

// After an error of a server that wants a token.
constexpr char kHowToGiveOne[] = "; this program takes one by --token-file=FILE or $DRAPE_TOKEN";

// As draped: CLI11 would take the next argument as the value, a flag perhaps.
bool LacksValue(const std::string& argument) {
  return argument.starts_with("--") && argument.ends_with('=');
}

// " run, demo, ..."
std::string Names(const CLI::App& app) {
  std::string names;
  for (const CLI::App* command : app.get_subcommands(/*filter=*/{})) {
    names += (names.empty() ? " " : ", ") + command->get_name();
  }
  return names;
}

}  // namespace

int Main(int argc, const char* const* argv) {
  CLI::App app("Client of the Drape cloth-simulation server.", "drape");
  app.set_version_flag("--version", DRAPE_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Exit codes: 0 done, 1 failed or interrupted, 2 usage, 3 done, but a cloth is faulted (run, "
      "demo, step).");
  Action action;
  for (const auto add :
       {AddRun, AddDemo, AddInfo, AddHealth, AddCreate, AddStep, AddRead, AddRender, AddWatch,
        AddLoad, AddList, AddDelete, AddSnapshot, AddRestore, AddAdmin}) {
    add(app, action);
  }
  if (argc > 1 && argv[1][0] != '-' && !IsCommand(app, argv[1])) {
    std::cerr << "drape: unknown command \"" << argv[1] << "\"; legal:" << Names(app) << "\n";
    return kUsage;
  }
  const char* const* const end = argv + argc;
  if (const auto lacking = std::find_if(argv + std::min(1, argc), end, LacksValue);
      lacking != end) {
    std::cerr << "drape: " << *lacking << " has no value; leave the flag out\n";
    return kUsage;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? kDone : kUsage;
  }
  try {
    return action();
  } catch (const CLI::ParseError& error) {
    std::cerr << "drape: " << error.what() << "\n";
    return kUsage;
  } catch (const Error& error) {  // it has code, reason and fields
    std::cerr << "drape: " << error.what()
              << (error.reason() == "INVALID_TOKEN" ? kHowToGiveOne : "") << "\n";
    return kFailed;
  } catch (const std::exception& error) {
    std::cerr << "drape: " << error.what() << "\n";
    return kFailed;
  }
}

}  // namespace drape::cli
