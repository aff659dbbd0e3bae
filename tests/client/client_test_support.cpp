#include "tests/client/client_test_support.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

#include "tests/support/paths/paths.h"

extern char** environ;

namespace drape::client_test {

namespace fs = std::filesystem;

TemporaryFolder::TemporaryFolder() {
  std::string folder = (fs::temp_directory_path() / "drape-test-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) throw std::runtime_error("mkdtemp " + folder);
  path_ = folder;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
}

std::string ReadText(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) throw std::runtime_error("no file " + path.string());
  return std::string(std::istreambuf_iterator<char>(file), {});
}

void WriteText(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  if (!file.flush()) throw std::runtime_error("cannot write " + path.string());
}

fs::path ProgramPath(const std::string& name) {
  return test::ProgramPath(name);
}

fs::path Example(const std::string& name) {
  return test::SourcePath("client/examples/" + name);
}

RunningProgram::RunningProgram(const std::string& name, const std::vector<std::string>& arguments,
                               const std::string& terminal)
    : has_terminal_(!terminal.empty()) {
  const std::string program = ProgramPath(name).string();
  std::vector<std::string> texts = {program};
  texts.insert(texts.end(), arguments.begin(), arguments.end());
  std::vector<char*> argv;
  for (std::string& text : texts) argv.push_back(text.data());
  argv.push_back(nullptr);
  const std::string out = folder_ / "out";
  const std::string err = has_terminal_ ? terminal : (folder_ / "err").string();
  constexpr int kFlags = O_CREAT | O_WRONLY | O_NOCTTY;
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, out.c_str(), kFlags, 0600);
  posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, err.c_str(), kFlags, 0600);
  const int error = posix_spawn(&pid_, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) throw std::runtime_error("cannot start " + program);
}

Outcome RunningProgram::Wait() {
  int status = 0;
  waitpid(pid_, &status, 0);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, ReadText(folder_ / "out"),
          has_terminal_ ? "" : ReadText(folder_ / "err")};
}

std::vector<std::string> Lines(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

Outcome RunProgram(const std::string& name, const std::vector<std::string>& arguments) {
  return RunningProgram(name, arguments).Wait();
}

std::string SceneWithAFault() {
  const auto cloth = [](const std::string& stiffness_n_per_m) {
    return R"({"spec": {
      "particles": {"positions_m": [0,0,0, 1.01,0,0], "masses_kg": [1, 1], "springs": [
        {"i": 0, "j": 1, "rest_length_m": 1, "stiffness_n_per_m": )" +
           stiffness_n_per_m + R"(}]},
      "environment": {"gravity_m_per_s2": [0, 0, 0]}, "settings": {"substeps": 1}}})";
  };
  return R"({"name": "springs", "time_step_s": 0.001, "duration_s": 0.02, "cloths": [)" +
         cloth("0") + "," + cloth("5e7") + "]}";
}

void FailNoError() {
  ADD_FAILURE() << "no drape::Error was thrown";
  throw std::logic_error("no drape::Error was thrown");
}

}  // namespace drape::client_test
