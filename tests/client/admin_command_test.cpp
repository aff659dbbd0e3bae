// drape admin, end to end.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "drape/admin.h"
#include "drape/client.h"
#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::Outcome;
using client_test::ProgramPath;
using client_test::RunProgram;
using client_test::TemporaryFolder;
using nlohmann::json;
using ::testing::HasSubstr;

class AdminCommand : public ::testing::Test {
 protected:
  static SpawnOptions Options(const std::string& socket) {
    SpawnOptions options;
    options.backend = "cpu";
    options.executable = ProgramPath("draped");
    options.flags = {"--admin-listen=unix:" + socket};
    return options;
  }

  Outcome Run(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "admin");
    arguments.push_back("--server=unix:" + socket_);
    return RunProgram("drape", arguments);
  }
  std::string Do(std::vector<std::string> arguments) {
    const Outcome outcome = Run(std::move(arguments));
    EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
    return outcome.out;
  }

  TemporaryFolder folder_;
  const std::string socket_ = folder_ / "admin";
  const Client client_ = Client::SpawnServer(Options(socket_));
};

TEST_F(AdminCommand, ShowsAndEndsWhatThereIs) {
  SessionOptions options;
  options.display_name = "the \x1b[2J first";
  Session first = client_.CreateSession(options), second = client_.CreateSession();
  first.Detach();
  v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(4);
  spec.mutable_grid()->set_rows(4);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  first.CreateCloth(spec);
  first.Step(2);

  const std::string tenants = Do({"tenants"});
  EXPECT_THAT(tenants, HasSubstr("particle-substeps/s"));
  EXPECT_THAT(tenants, HasSubstr("(none)"));
  const json use = json::parse(Do({"tenants", "--json"}));
  ASSERT_EQ(use.size(), 1u);
  EXPECT_EQ(use[0]["session_count"], 2);
  EXPECT_EQ(use[0]["particle_count"], "16");

  const std::string sessions = Do({"sessions"});
  EXPECT_THAT(sessions, HasSubstr("the \\x1B[2J first")) << "controls of a terminal are shown";
  EXPECT_THAT(sessions, HasSubstr("waiting"));
  EXPECT_EQ(sessions.find(first.name()), std::string::npos);
  const json list = json::parse(Do({"sessions", "--json"}));
  ASSERT_EQ(list.size(), 2u);
  const std::string number = list[0]["number"];
  EXPECT_THAT(Do({"drop", number}), HasSubstr("dropped"));
  EXPECT_EQ(json::parse(Do({"sessions", "--json"})).size(), 1u);
  const Outcome again = Run({"drop", number});
  EXPECT_EQ(again.exit_code, 1);
  EXPECT_THAT(again.err, HasSubstr("SESSION_NOT_FOUND"));

  const std::string trace = folder_ / "trace.json";
  EXPECT_THAT(Do({"trace", trace, "--seconds=0.1"}), HasSubstr("events"));
  EXPECT_TRUE(json::parse(client_test::ReadText(trace)).contains("traceEvents"));
  EXPECT_EQ(Run({"trace", trace, "--seconds=nan"}).exit_code, 2);

  EXPECT_THAT(Do({"log-level", "debug"}), HasSubstr("formerly info"));
  EXPECT_EQ(Run({"log-level", "loud"}).exit_code, 2);
  EXPECT_THAT(Run({"checkpoint"}).err, HasSubstr("NO_CHECKPOINTS"));
  EXPECT_EQ(RunProgram("drape", {"admin"}).exit_code, 2);
  // The port for clients is not for operators.
  const Outcome refused = RunProgram("drape", {"admin", "drain", "--server=" + client_.address()});
  EXPECT_EQ(refused.exit_code, 1);
  EXPECT_THAT(refused.err, HasSubstr("ADMIN_ONLY"));
  EXPECT_EQ(client_.CheckHealth(), Health::kServing);
  EXPECT_THAT(Do({"drain"}), HasSubstr("drains"));
}

}  // namespace
}  // namespace drape
