// The container image against the programs that it carries: packages, flags, ports, grace periods.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "server/config.h"
#include "tests/support/paths/paths.h"

namespace drape {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const fs::path kRoot = test::SourcePath("");
const fs::path kDocker = kRoot / "docker";

std::string ReadFile(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  EXPECT_FALSE(text.str().empty()) << path;
  return text.str();
}

// The output of a command; the test fails when the command does.
std::string Output(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  if (pipe == nullptr) {
    ADD_FAILURE() << "cannot start " << command;
    return "";
  }
  std::string text;
  char part[4096];
  for (size_t size; (size = fread(part, 1, sizeof(part), pipe)) > 0;) text.append(part, size);
  EXPECT_EQ(pclose(pipe), 0) << command;
  return text;
}

// The first group of every match.
std::vector<std::string> Groups(const std::string& text, const std::string& pattern) {
  const std::regex expression(pattern, std::regex::multiline);
  std::vector<std::string> groups;
  for (std::sregex_iterator it(text.begin(), text.end(), expression), end; it != end; ++it) {
    groups.push_back((*it)[1]);
  }
  return groups;
}

std::string OnlyMatch(const std::string& text, const std::string& pattern) {
  const std::vector<std::string> matches = Groups(text, pattern);
  EXPECT_EQ(matches.size(), 1u) << pattern;
  return matches.empty() ? "" : matches[0];
}

// Debian packages of the shared libraries that the programs name.
std::set<std::string> LinkedPackages() {
  std::string query = "LC_ALL=C dpkg-query -S";
  size_t library_count = 0;
  for (const char* program : {"draped", "drape"}) {
    const std::string dump =
        Output(std::string("objdump -p ") + test::ProgramPath(program).string());
    for (const std::string& library : Groups(dump, R"(^\s*NEEDED\s+(\S+))")) {
      query += " '*-linux-gnu/" + library + "'";
      ++library_count;
    }
  }
  EXPECT_GT(library_count, 8u);
  std::set<std::string> packages;
  for (const std::string& package : Groups(Output(query), R"(^([^:\s]+):)")) {
    packages.insert(package);
  }
  return packages;
}

// The packages that the final stage installs.
std::set<std::string> ImagePackages() {
  const std::string dockerfile = ReadFile(kDocker / "Dockerfile");
  const std::string list =
      OnlyMatch(dockerfile, R"(--no-install-recommends((?:\s|\\|[a-z0-9.+-])*)&&)");
  std::set<std::string> packages;
  for (const std::string& package : Groups(list, R"(([a-z0-9.+-]+))")) packages.insert(package);
  return packages;
}

// ["--flag", ...] as draped reads it; the files of TLS and tokens are replaced by one that exists.
Config Parse(const std::vector<std::string>& arguments) {
  std::vector<std::string> words = {"draped"};
  for (const std::string& argument : arguments) {
    words.push_back(std::regex_replace(argument, std::regex("=/etc/drape/(tls/)?"),
                                       "=" + kDocker.string() + "/"));
    if (words.back().find(".pem") == std::string::npos &&
        words.back().find("--token-file") == std::string::npos) {
      continue;
    }
    words.back() =
        words.back().substr(0, words.back().find('=')) + "=" + (kDocker / "Dockerfile").string();
  }
  std::vector<const char*> pointers;
  for (const std::string& word : words) pointers.push_back(word.c_str());
  CommandLine line = ParseCommandLine(static_cast<int>(pointers.size()), pointers.data());
  EXPECT_FALSE(line.exit_code) << "draped refuses " << ::testing::PrintToString(arguments);
  return line.config;
}

std::vector<std::string> Words(const std::string& json) {
  return nlohmann::json::parse(json).get<std::vector<std::string>>();
}

// The words that the image puts before a command.
std::vector<std::string> EntryPoint() {
  const std::string text = OnlyMatch(ReadFile(kDocker / "Dockerfile"), R"(^ENTRYPOINT (\[.*\])$)");
  std::vector<std::string> words = Words(text);
  EXPECT_EQ(words.at(0), "draped");
  words.erase(words.begin());
  return words;
}

std::string PortOf(const std::string& address) {
  return address.substr(address.rfind(':') + 1);
}

TEST(ImageTest, InstallsThePackagesThatTheProgramsNeedAndNoOthers) {
  const std::set<std::string> base = {"libc6", "libgcc-s1", "libstdc++6"};  // of debian:12-slim
  const std::set<std::string> opened = {"libegl1", "libegl-mesa0", "libgl1-mesa-dri", "libopengl0"};
  std::set<std::string> needed = LinkedPackages();
  for (const std::string& package : base) {
    EXPECT_EQ(needed.erase(package), 1u) << package << " is no longer linked";
  }
  needed.insert(opened.begin(), opened.end());
  EXPECT_EQ(ImagePackages(), needed) << "docker/Dockerfile does not install what the programs use";
}

TEST(ImageTest, CommandsAreFlagsThatTheServerTakes) {
  std::vector<std::string> commands = Groups(ReadFile(kDocker / "Dockerfile"), R"(^CMD (\[.*\])$)");
  for (const char* file : {"compose.yaml", "compose.gpu.yaml", "compose.tls.yaml",
                           "fleet/compose.yaml", "exposed/compose.yaml"}) {
    for (const std::string& command :
         Groups(ReadFile(kDocker / file), R"(^ *command: (\[.*\])$)")) {
      commands.push_back(command);
    }
  }
  EXPECT_EQ(commands.size(), 6u)
      << "of image, compose.yaml, compose.tls.yaml, exposed/, two of fleet/";
  for (const std::string& command : commands) {
    std::vector<std::string> arguments = EntryPoint();
    for (const std::string& word : Words(command)) arguments.push_back(word);
    const Config config = Parse(arguments);
    EXPECT_NE(config.insecure, config.tls.is_on()) << command;
  }
}

TEST(ImageTest, EveryFileNamesThePortTheServerListensOn) {
  const std::string listen = Parse(EntryPoint()).listen;
  EXPECT_THAT(listen, ::testing::StartsWith("0.0.0.0:"));
  const std::string port = PortOf(listen);
  const std::string dockerfile = ReadFile(kDocker / "Dockerfile");
  EXPECT_EQ(OnlyMatch(dockerfile, R"(^EXPOSE (\d+)$)"), port);
  EXPECT_EQ(OnlyMatch(dockerfile, R"(--server=127\.0\.0\.1:(\d+))"), port);
  EXPECT_EQ(OnlyMatch(ReadFile(kDocker / "compose.tls.yaml"), R"(/dev/tcp/127\.0\.0\.1/(\d+))"),
            port);
  const std::string compose = ReadFile(kDocker / "compose.yaml");
  EXPECT_THAT(compose, HasSubstr("\"127.0.0.1:${DRAPE_PORT:-" + port + "}:" + port + "\""))
      << "published to this machine only";
}

TEST(ImageTest, ContainersMayTakeAsLongToStopAsTheServer) {
  const int patience_ms = std::stoi(std::regex_replace(
      OnlyMatch(ReadFile(kRoot / "server/signals.cpp"), R"(kStopPatience\{([\d']+)\})"),
      std::regex("'"), ""));
  for (const char* file : {"compose.yaml", "fleet/compose.yaml", "exposed/compose.yaml"}) {
    const int grace_s =
        std::stoi(OnlyMatch(ReadFile(kDocker / file), R"(stop_grace_period: (\d+)s)"));
    EXPECT_GT(grace_s * 1000, static_cast<int>(Config{}.drain_grace_ms) + patience_ms) << file;
  }
}

TEST(FleetTest, TheProxyRoutesToTheServersOfComposeByTheirNamesAndPorts) {
  const std::string compose = ReadFile(kDocker / "fleet/compose.yaml");
  const std::string proxy = ReadFile(kDocker / "fleet/haproxy.cfg");
  const std::vector<std::string> names = Groups(compose, R"(^  draped-(\w+):$)");
  const std::vector<std::string> commands = Groups(compose, R"(^    command: (\[.*\])$)");
  ASSERT_EQ(names.size(), 2u);
  ASSERT_EQ(commands.size(), names.size());
  EXPECT_EQ(Groups(proxy, R"(^  server (\w+) )"), names);
  for (size_t k = 0; k < names.size(); ++k) {
    std::vector<std::string> arguments = EntryPoint();
    for (const std::string& word : Words(commands[k])) arguments.push_back(word);
    const Config config = Parse(arguments);
    EXPECT_EQ(config.server_id, names[k]);
    EXPECT_EQ(config.max_connections_per_peer, 0u) << "all come from the proxy";
    EXPECT_THAT(config.metrics_listen, ::testing::StartsWith("0.0.0.0:"));
    EXPECT_THAT(proxy,
                HasSubstr("\n  server " + names[k] + " draped-" + names[k] + ":" +
                          PortOf(config.listen) + " port " + PortOf(config.metrics_listen) + "\n"));
  }
}

TEST(FleetTest, ComposePublishesTheProxyToThisMachineAlone) {
  const std::string compose = ReadFile(kDocker / "fleet/compose.yaml");
  const std::string port =
      OnlyMatch(ReadFile(kDocker / "fleet/haproxy.cfg"), R"(^  bind 127\.0\.0\.1:(\d+) )");
  EXPECT_EQ(Groups(compose, R"re(^      - "(127\S*:\d+)"$)re"),
            std::vector<std::string>{"127.0.0.1:${DRAPE_PORT:-" + port + "}:" + port});
  EXPECT_THAT(compose, HasSubstr("sed 's/bind 127.0.0.1:/bind :/' /etc/drape/haproxy.cfg"));
  EXPECT_THAT(compose, HasSubstr("./haproxy.cfg:/etc/drape/haproxy.cfg:ro"));
}

TEST(FleetTest, CommandsGoToTheSocketThatTheProxyListensOn) {
  const std::string socket =
      OnlyMatch(ReadFile(kDocker / "fleet/haproxy.cfg"), R"(^  stats socket (\S+) mode 600 )");
  EXPECT_THAT(ReadFile(kDocker / "fleet/tell.sh"), HasSubstr("->new(\"" + socket + "\")"));
  EXPECT_THAT(ReadFile(kDocker / "fleet/README.md"), HasSubstr("socat - " + socket + "`"));
}

TEST(ImageTest, EveryFileThatTheImageCopiesIsInItsContext) {
  const std::vector<std::string> allowed = Groups(ReadFile(kRoot / ".dockerignore"), R"(^!(\S+)$)");
  for (const std::string& path : allowed) EXPECT_TRUE(fs::exists(kRoot / path)) << path;
  std::vector<std::string> missing;
  for (const std::string& source :
       Groups(ReadFile(kDocker / "Dockerfile"), R"(^COPY (docker/\S+|run) )")) {
    if (!::testing::Matches(::testing::Contains(source))(allowed)) missing.push_back(source);
  }
  EXPECT_THAT(missing, IsEmpty());
}

}  // namespace
}  // namespace drape
