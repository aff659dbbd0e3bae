// The device is lost under a running server, which begins anew in the same process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <thread>

#include "tests/support/paths/paths.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

class DeviceLoss : public testing::Test {
 protected:
  void StartServer(std::vector<std::string> flags) {
    flags.push_back("--backend=gl");
    server_ = std::make_unique<ServerProcess>(
        flags, ServerProcess::Environment{{"LD_PRELOAD", ProgramPath("liblost_device.so").string()},
                                          {"DRAPE_TEST_LOST_DEVICE", dir_ / "order"}});
    ASSERT_TRUE(server_->WaitUntilUp());
    stub_ = server_->NewStub();
  }

  void Order(const std::string& word) {
    std::ofstream(dir_ / "draft") << word;
    fs::rename(dir_ / "draft", dir_ / "order");
  }

  std::string Incarnation() {
    return Call(*stub_, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value.incarnation();
  }

  // Until another run of the server answers.
  void AwaitNewIncarnation(const std::string& former) {
    for (int k = 0; k < 600; ++k) {
      stub_ = server_->NewStub();
      const std::string now = Incarnation();
      if (!now.empty() && now != former) return;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    FAIL() << "no new run answers:\n" << server_->Log();
  }

  grpc::Status StatusOfStep(const std::string& session, const Ids& ids) {
    return Call(*stub_, &Stub::Step, StepsOf(session, ids, 1)).status;
  }

  ScratchDir dir_;
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<Stub> stub_;
};

TEST_F(DeviceLoss, SessionsWithCheckpointsGoOnWithTheSameBits) {
  for (const std::string order : {"reset", "hang"}) {
    SCOPED_TRACE(order);
    const std::string folder = dir_ / order;
    StartServer(
        {"--checkpoint-dir=" + folder, "--checkpoint-interval-s=0.1", "--device-timeout-s=1"});
    const std::string address = server_->Address();
    const std::string session = NewSession(*stub_);
    const Ids ids = Create(*stub_, HangingSheet(session, 5, 2));
    Step(*stub_, StepsOf(session, ids, 5));
    const std::string bits = Bits(*stub_, session, ids);
    // Long enough for several checkpoints.
    std::this_thread::sleep_for(std::chrono::seconds(1));
    const std::string former = Incarnation();
    Order(order);
    EXPECT_EQ(StatusOfStep(session, ids).error_code(), grpc::StatusCode::UNAVAILABLE);
    ASSERT_NO_FATAL_FAILURE(AwaitNewIncarnation(former));
    EXPECT_TRUE(server_->is_running()) << "another process";
    EXPECT_EQ(server_->Address(), address);
    EXPECT_TRUE(Bits(*stub_, session, ids) == bits);
    Step(*stub_, StepsOf(session, ids, 1));
    EXPECT_EQ(Get(*stub_, session, ids[0]).step(), 6u);
    EXPECT_THAT(server_->Log(), HasSubstr("device_lost"));
    server_->Signal(SIGTERM);
    EXPECT_EQ(server_->WaitForExit(), 0) << server_->Log();
  }
}

TEST_F(DeviceLoss, WithoutCheckpointsClientsAreToldThatTheirStateIsLost) {
  StartServer({});
  const std::string session = NewSession(*stub_);
  const Ids ids = Create(*stub_, HangingSheet(session, 5));
  const std::string former = Incarnation();
  Order("reset");
  EXPECT_EQ(StatusOfStep(session, ids).error_code(), grpc::StatusCode::UNAVAILABLE);
  ASSERT_NO_FATAL_FAILURE(AwaitNewIncarnation(former));
  EXPECT_EQ(ReasonOf(StatusOfStep(session, ids)), "SESSION_LOST");
  EXPECT_EQ(ReasonOf(StatusOfStep(session + "0", ids)), "SESSION_NOT_FOUND");
  // What was lost stays so over another loss.
  const std::string second = Incarnation();
  const std::string another = NewSession(*stub_);
  const Ids its = Create(*stub_, HangingSheet(another, 5));
  EXPECT_TRUE(StatusOfStep(another, its).ok());
  Order("reset");
  StatusOfStep(another, its);
  ASSERT_NO_FATAL_FAILURE(AwaitNewIncarnation(second));
  EXPECT_EQ(ReasonOf(StatusOfStep(session, ids)), "SESSION_LOST");
  EXPECT_EQ(ReasonOf(StatusOfStep(another, its)), "SESSION_LOST");
  EXPECT_THAT(server_->Log(), testing::Not(HasSubstr(session))) << "a whole name in the log";
}

TEST_F(DeviceLoss, AServerWhoseDeviceIsLostAgainAndAgainEnds) {
  StartServer({});
  Order("resets");
  for (int loss = 0; loss < 5; ++loss) {
    const std::string former = Incarnation();
    const std::string session = NewSession(*stub_);
    v1::CreateClothsRequest sheet = HangingSheet(session, 5);
    const auto created = Call(*stub_, &Stub::CreateCloths, sheet);
    if (created.status.ok()) StatusOfStep(session, {created.value.cloth_ids(0)});
    if (loss < 4) {
      ASSERT_NO_FATAL_FAILURE(AwaitNewIncarnation(former));
    }
  }
  EXPECT_EQ(server_->WaitForExit(), 1);
  EXPECT_THAT(server_->Log(), HasSubstr("begins_anew=false"));
}

}  // namespace
}  // namespace drape::test
