#include "server/config.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <vector>

namespace drape {
namespace {

CommandLine Parse(std::vector<const char*> flags) {
  flags.insert(flags.begin(), "draped");
  return ParseCommandLine(static_cast<int>(flags.size()), flags.data());
}

TEST(Config, DefaultsAreSafe) {
  const CommandLine line = Parse({});
  ASSERT_FALSE(line.exit_code);
  EXPECT_EQ(line.config.listen, "127.0.0.1:7743");
  EXPECT_EQ(line.config.backend, BackendChoice::kAuto);
  EXPECT_FALSE(line.config.insecure);
  EXPECT_EQ(line.config.requests.max_request_bytes, 64u << 20);
  EXPECT_EQ(line.config.requests.default_ttl_s, 300);
}

TEST(Config, FlagsReachTheirLimits) {
  const CommandLine line = Parse(
      {"--backend=reference", "--max-sessions=7", "--session-ttl-s=2.5", "--threads=3",
       "--max-queued-requests-per-session=9", "--max-particles-per-cloth=100",
       "--max-particles-per-picture=200", "--max-queued-pictures=11",
       "--max-pictures-in-flight-per-session=12", "--max-queue-delay-us=13",
       "--max-particle-substeps-per-s-per-tenant=2.5e9", "--max-builder-s-per-s-per-tenant=0.25"});
  ASSERT_FALSE(line.exit_code);
  EXPECT_EQ(line.config.backend, BackendChoice::kReference);
  EXPECT_EQ(line.config.sessions.max_sessions, 7u);
  EXPECT_EQ(line.config.requests.default_ttl_s, 2.5);
  EXPECT_EQ(line.config.threads, 3u);
  EXPECT_EQ(line.config.scheduler.max_queued_requests_per_session, 9u);
  EXPECT_EQ(line.config.scheduler.max_queue_delay_us, 13);
  EXPECT_EQ(line.config.max_particle_substeps_per_s_per_tenant, 2.5e9);
  EXPECT_EQ(line.config.max_builder_s_per_s_per_tenant, 0.25);
  EXPECT_EQ(line.config.requests.model.max_particles, 100u);
  EXPECT_EQ(line.config.pictures.max_particles_per_picture, 200u);
  EXPECT_EQ(line.config.pictures.max_queued_pictures, 11u);
  EXPECT_EQ(line.config.pictures.max_pictures_in_flight_per_session, 12u);
}

TEST(Config, UsageErrorsAreTwoAndHelpIsZero) {
  EXPECT_EQ(Parse({"--help"}).exit_code, 0);
  EXPECT_EQ(Parse({"--version"}).exit_code, 0);
  for (const char* flag : {"--nonsense", "--backend=abacus", "--max-sessions=0", "--max-sessions=x",
                           "--max-queue-delay-us=-1", "--max-queue-delay-us=1000001",
                           "--session-ttl-s=0.5", "--session-ttl-s=nan", "--tls-cert=/dev/null",
                           "--listen=localhost", "--listen=127.0.0.1:65536",
                           "--listen=127.0.0.1:-1", "--listen=:1", "--listen=127.0.0.1:http"}) {
    EXPECT_EQ(Parse({flag}).exit_code, 2) << flag;
  }
  EXPECT_EQ(Parse({"--token-file=", "--listen=127.0.0.1:0"}).exit_code, 2)
      << "the flag behind it is no value";
}

class ConfigFileTest : public testing::Test {
 protected:
  CommandLine ParseFile(const std::string& text, std::vector<const char*> flags = {}) {
    std::ofstream(path_) << text;
    const std::string flag = "--config=" + path_;
    flags.push_back(flag.c_str());
    return Parse(flags);
  }
  ~ConfigFileTest() override { std::remove(path_.c_str()); }

  const std::string path_ = testing::TempDir() + "drape_config_test_" + std::to_string(getpid());
};

TEST_F(ConfigFileTest, ItsThreeFormsMeanTheSame) {
  for (const char* text :
       {"# of a test\nlisten: \"127.0.0.1:99\" max_sessions: 5\ninsecure: true\nsession_ttl_s: "
        "1.5\n",
        R"({"listen": "127.0.0.1:99", "max-sessions": 5, "insecure": true, "session-ttl-s": 1.5})",
        "listen=127.0.0.1:99\nmax-sessions=5\ninsecure=true\nsession-ttl-s=1.5\n"}) {
    const CommandLine line = ParseFile(text);
    ASSERT_FALSE(line.exit_code) << text;
    EXPECT_EQ(line.config.listen, "127.0.0.1:99");
    EXPECT_EQ(line.config.sessions.max_sessions, 5u);
    EXPECT_EQ(line.config.requests.default_ttl_s, 1.5);
    EXPECT_TRUE(line.config.insecure);
  }
}

TEST_F(ConfigFileTest, TheCommandLineWins) {
  EXPECT_EQ(ParseFile(R"({"max-sessions": 5})", {"--max-sessions=6"}).config.sessions.max_sessions,
            6u);
}

TEST_F(ConfigFileTest, UnknownNamesAndBrokenFilesAreUsageErrors) {
  EXPECT_EQ(ParseFile(R"({"max-session": 5})").exit_code, 2);
  EXPECT_EQ(ParseFile(R"({"max-sessions": )").exit_code, 2);
  EXPECT_EQ(ParseFile(R"({"max-sessions": [1, 2]})").exit_code, 2);
  EXPECT_EQ(ParseFile("max-session=5\n").exit_code, 2);
  testing::internal::CaptureStderr();
  EXPECT_EQ(ParseFile("max_sessions: 5\nmax_session: 5\n").exit_code, 2);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::AllOf(testing::HasSubstr("line 2"), testing::HasSubstr("max_session")));
  // In JSON names are those of the flags.
  for (const char* text : {R"({"max_sessions": 5})", R"({"max-sesions": 5})", "max_sessions=5\n"}) {
    testing::internal::CaptureStderr();
    EXPECT_EQ(ParseFile(text).exit_code, 2) << text;
    EXPECT_THAT(testing::internal::GetCapturedStderr(),
                testing::HasSubstr("did you mean 'max-sessions'?"));
  }
  testing::internal::CaptureStderr();
  EXPECT_EQ(ParseFile(R"({"something-else": 5})").exit_code, 2);
  EXPECT_THAT(testing::internal::GetCapturedStderr(),
              testing::Not(testing::HasSubstr("did you mean")));
  for (const char* text :
       {"max_sessions: 0", "max_sessions: \"5\"", "max_sessions: -1", "listen: 5", "insecure: 7",
        "max_sessions: 5 max_sessions: 6", "help: true", "print_config: true", "list_devices: true",
        "max_sessions {}"}) {
    EXPECT_EQ(ParseFile(text).exit_code, 2) << text;
  }
}

TEST_F(ConfigFileTest, WhatIsPrintedReadsAsTheSame) {
  const std::vector<const char*> flags = {"--listen=[::1]:99", "--insecure",
                                          "--server-id=a1",    "--session-ttl-s=2.5",
                                          "--threads=3",       "--max-queue-delay-us=13",
                                          "--device=\"a\\b\"", "--log-format=json"};
  const auto print = [](std::vector<const char*> with) {
    with.push_back("--print-config");
    testing::internal::CaptureStdout();
    EXPECT_EQ(Parse(std::move(with)).exit_code, 0);
    return testing::internal::GetCapturedStdout();
  };
  const std::string printed = print(flags);
  EXPECT_THAT(printed, testing::HasSubstr("\nmax_queue_delay_us: 13\n"));
  EXPECT_NE(printed, print({}));
  const CommandLine line = ParseFile(printed);
  ASSERT_FALSE(line.exit_code);
  EXPECT_EQ(line.config.device, "\"a\\b\"");
  EXPECT_EQ(line.config.log_format, LogFormat::kJson);
  const std::string flag = "--config=" + path_;
  EXPECT_EQ(print({flag.c_str()}), printed);
}

// What docker/operating.md says of them.
TEST(FitToMemory, LimitsTogetherAreLessThanTheMemory) {
  const auto sum_of = [](const Config& config) {
    return config.sessions.max_model_bytes + config.sessions.max_saved_bytes +
           config.sessions.max_mesh_collider_bytes + config.sessions.max_request_id_bytes +
           config.sessions.max_remembered_bytes + 2 * config.requests.max_unread_bytes +
           config.max_transport_bytes + config.scheduler.max_long_step_bytes;
  };
  for (const uint64_t gibibytes : {1, 4, 16, 31, 32, 512}) {
    Config config;
    FitToMemory(config, gibibytes << 30);
    EXPECT_LE(sum_of(config), (gibibytes << 30) * 79 / 96) << gibibytes;
    EXPECT_LE(config.sessions.max_state_bytes, (gibibytes << 30) / 32 * 6) << gibibytes;
    EXPECT_LE(config.sessions.max_mesh_collider_bytes_per_session,
              config.sessions.max_mesh_collider_bytes);
    EXPECT_LE(config.requests.max_unread_bytes_per_session, config.requests.max_unread_bytes);
  }
  Config large;
  FitToMemory(large, uint64_t{32} << 30);
  EXPECT_EQ(sum_of(large), sum_of(Config()));
  EXPECT_EQ(large.sessions.max_model_bytes, Config().sessions.max_model_bytes);
}

}  // namespace
}  // namespace drape
