// What survives the process: sessions come back from the disk and go on with the same bits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <thread>

#include "server/api/sha256.h"
#include "server/checkpoints/durable_file.h"
#include "server/core/text.h"
#include "tests/api/requests.h"
#include "tests/system/calls.h"
#include "tests/system/random_traffic.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using testing::HasSubstr;
namespace fs = std::filesystem;

bool Wait(const std::function<bool()>& is_done) {
  for (int k = 0; k < 600; ++k) {
    if (is_done()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  return false;
}

std::vector<fs::path> FilesOf(const std::string& folder, const std::string& extension) {
  std::vector<fs::path> files;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(folder, ignored)) {
    if (entry.path().extension() == extension) files.push_back(entry.path());
  }
  return files;
}

std::string BytesOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Checkpoints : public testing::Test {
 protected:
  std::unique_ptr<ServerProcess> StartServer(const std::string& interval_s = "0.1") {
    auto server = std::make_unique<ServerProcess>(std::vector<std::string>{
        "--backend=cpu", "--checkpoint-dir=" + folder_, "--checkpoint-interval-s=" + interval_s});
    EXPECT_TRUE(server->WaitUntilUp());
    return server;
  }
  // Several intervals of 0.1 s.
  void WaitForACheckpoint() {
    ASSERT_TRUE(Wait([&] { return !FilesOf(folder_, ".checkpoint").empty(); }));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));
  }

  ScratchDir dir_;
  std::string folder_ = dir_ / "checkpoints";
};

v1::StepRequest Until(const std::string& session, uint64_t id, uint64_t step) {
  v1::StepRequest request;
  request.set_session(session);
  request.add_cloth_ids(id);
  request.set_until_step(step);
  return request;
}

TEST_F(Checkpoints, AKilledServerGoesOnFromThemWithTheSameBits) {
  // Sheets with springs, among moving colliders, touching themselves, gripped, asleep; meshes.
  for (const uint32_t seed : {0u, 2u, 3u, 4u, 5u, 7u}) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    fs::remove_all(folder_);
    auto server = StartServer();
    auto stub = server->NewStub();
    const std::string session = NewSession(*stub);
    RandomTraffic traffic(seed, true);
    const Ids ids = Create(*stub, traffic.Creation(session));
    for (uint32_t k = 0; k < 3; ++k) Step(*stub, traffic.Steps(session, ids));
    ASSERT_NO_FATAL_FAILURE(WaitForACheckpoint());
    const uint64_t known = Get(*stub, session, ids[0]).step();
    // Motions go on by themselves: no controls from here on.
    for (const uint64_t id : ids) Step(*stub, Until(session, id, known + 12));
    const std::string bits = Bits(*stub, session, ids);
    const v1::Cloth cloth = Get(*stub, session, ids[1]);
    server->Signal(SIGKILL);
    EXPECT_EQ(server->WaitForExit(), 128 + SIGKILL);

    server = StartServer();
    stub = server->NewStub();
    EXPECT_THAT(server->Log(), HasSubstr("session_recovered"));
    EXPECT_THAT(server->Log(), HasSubstr("exact=true"));
    v1::ListClothsRequest list;
    list.set_session(session);
    ASSERT_EQ(Call(*stub, &Stub::ListCloths, list).value.cloths_size(), 3);
    const uint64_t recovered = Get(*stub, session, ids[0]).step();
    EXPECT_LE(recovered, known + 12);
    EXPECT_GT(recovered, 0u);
    for (const uint64_t id : ids) Step(*stub, Until(session, id, known + 12));
    EXPECT_TRUE(Bits(*stub, session, ids) == bits) << "from step " << recovered;
    EXPECT_EQ(Get(*stub, session, ids[1]).DebugString(), cloth.DebugString());
    // Ids are never given again.
    const Ids later = Create(*stub, HangingSheet(session, 3));
    EXPECT_THAT(ids, testing::Not(testing::Contains(later[0])));
  }
}

// Nothing is done for a client that takes what came back for what it knows.
TEST_F(Checkpoints, AClientThatKnowsAnEarlierRunIsTold) {
  auto server = StartServer();
  auto stub = server->NewStub();
  v1::Session session = Call(*stub, &Stub::CreateSession, v1::CreateSessionRequest()).value;
  const uint64_t id = Create(*stub, HangingSheet(session.name(), 4))[0];
  const std::string before = session.incarnation();
  std::string message;
  EXPECT_EQ(before,
            Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value.incarnation());
  const auto step = [&](const std::string& incarnation) {
    grpc::ClientContext context;
    context.AddMetadata("x-drape-incarnation", incarnation);
    v1::StepResponse answer;
    const grpc::Status status = stub->Step(&context, StepsOf(session.name(), {id}, 1), &answer);
    message = status.error_message();
    return ReasonOf(status);
  };
  EXPECT_EQ(step(before), "");
  EXPECT_EQ(step("another"), "STATE_LOST");
  EXPECT_THAT(message, HasSubstr("it was created in the present one"));
  server->Signal(SIGTERM);
  ASSERT_EQ(server->WaitForExit(), 0);

  server = StartServer();
  stub = server->NewStub();
  EXPECT_EQ(step(before), "STATE_LOST");
  EXPECT_THAT(message, testing::ContainsRegex("as it was at 2.*ended in order nothing is lost"));
  EXPECT_EQ(Get(*stub, session.name(), id).step(), 1u) << "nothing is done";
  v1::GetSessionRequest get;
  get.set_name(session.name());
  session = Call(*stub, &Stub::GetSession, get).value;
  EXPECT_NE(session.incarnation(), before);
  EXPECT_EQ(step(session.incarnation()), "");
  EXPECT_EQ(Get(*stub, session.name(), id).step(), 2u);
}

TEST_F(Checkpoints, ADrainLosesNothing) {
  auto server = StartServer("3600");
  auto stub = server->NewStub();
  const std::string session = NewSession(*stub, 77);
  const std::string empty = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 5, 2));
  v1::DeleteClothsRequest deletion;
  deletion.set_session(session);
  deletion.add_cloth_ids(ids[0]);
  ASSERT_TRUE(Call(*stub, &Stub::DeleteCloths, deletion).status.ok());
  Step(*stub, StepsOf(session, {ids[1]}, 7));
  const std::string bits = Bits(*stub, session, {ids[1]});
  const auto before = Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest());
  server->Signal(SIGTERM);
  ASSERT_EQ(server->WaitForExit(), 0) << server->Log();

  server = StartServer("3600");
  stub = server->NewStub();
  EXPECT_TRUE(Bits(*stub, session, {ids[1]}) == bits);
  v1::GetSessionRequest get;
  get.set_name(session);
  EXPECT_EQ(Call(*stub, &Stub::GetSession, get).value.ttl_s(), 77);
  get.set_name(empty);
  EXPECT_TRUE(Call(*stub, &Stub::GetSession, get).status.ok());
  // A cloth that was deleted stays so, and a client can tell that the server is another run.
  v1::GetClothRequest cloth;
  cloth.set_session(session);
  cloth.set_cloth_id(ids[0]);
  EXPECT_EQ(ReasonOf(Call(*stub, &Stub::GetCloth, cloth).status), "CLOTH_NOT_FOUND");
  EXPECT_NE(Call(*stub, &Stub::GetServerInfo, v1::GetServerInfoRequest()).value.incarnation(),
            before.value.incarnation());
}

// Signals come in twos (process groups, `timeout`), or again from an impatient supervisor.
TEST_F(Checkpoints, SignalsThatComeAgainEndTheGraceAndNotTheWriting) {
  ServerProcess server({"--backend=cpu", "--checkpoint-dir=" + folder_,
                        "--checkpoint-interval-s=3600", "--drain-grace-ms=3600000"});
  ASSERT_TRUE(server.WaitUntilUp());
  auto stub = server.NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 32));
  grpc::ClientContext context;
  const auto stream = BeginEndlessSteps(*stub, context, session, ids);
  server.Signal(SIGTERM);
  ASSERT_TRUE(Wait([&] { return server.Log().find("draining") != std::string::npos; }));
  server.Signal(SIGTERM);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  EXPECT_THAT(server.Log(), HasSubstr("signal_ignored"));
  EXPECT_THAT(server.Log(), testing::Not(HasSubstr("draining_at_once")));
  server.Signal(SIGTERM);
  EXPECT_EQ(server.WaitForExit(), 0) << server.Log();
  EXPECT_THAT(server.Log(), HasSubstr("checkpoints_written sessions=1"));

  const auto next = StartServer("3600");
  stub = next->NewStub();
  EXPECT_GT(Get(*stub, session, ids[0]).step(), 0u);
}

// Also those that were given after the last checkpoint, whose cloths are lost: two runs that follow
// one checkpoint give different ones.
TEST_F(Checkpoints, IdsThatWereLostAreNotGivenAgain) {
  auto server = StartServer("3600");
  auto stub = server->NewStub();
  const std::string session = NewSession(*stub);
  std::vector<uint64_t> given = Create(*stub, HangingSheet(session, 3));
  server->Signal(SIGTERM);
  ASSERT_EQ(server->WaitForExit(), 0) << server->Log();
  for (int k = 0; k < 3; ++k) {
    server = StartServer("3600");
    const Ids ids = Create(*server->NewStub(), HangingSheet(session, 3, 2));
    given.insert(given.end(), ids.begin(), ids.end());
    server->Signal(SIGKILL);
    ASSERT_EQ(server->WaitForExit(), 128 + SIGKILL);
  }
  EXPECT_EQ(std::set<uint64_t>(given.begin(), given.end()).size(), given.size());
  EXPECT_EQ(BytesOf(folder_ + "/starts"), "4\n");
}

TEST_F(Checkpoints, WhatHasEndedIsForgottenAndWhatHasExpiredIsKeptAside) {
  auto server = StartServer();
  auto stub = server->NewStub();
  const std::string deleted = NewSession(*stub);
  const std::string expiring = NewSession(*stub, 1);
  Create(*stub, HangingSheet(expiring, 4));
  ASSERT_TRUE(Wait([&] { return FilesOf(folder_, ".checkpoint").size() == 2; }));
  v1::DeleteSessionRequest deletion;
  deletion.set_name(deleted);
  ASSERT_TRUE(Call(*stub, &Stub::DeleteSession, deletion).status.ok());
  ASSERT_TRUE(Wait([&] { return FilesOf(folder_, ".checkpoint").empty(); }));
  v1::GetSessionRequest get;
  get.set_name(expiring);
  EXPECT_THAT(Call(*stub, &Stub::GetSession, get).status.error_message(),
              HasSubstr("the server may have kept them"));
  // A session that has expired is there all the time.
  const auto kept = FilesOf(folder_ + "/expired", ".snapshot");
  ASSERT_EQ(kept.size(), 1u);

  const std::string session = NewSession(*stub);
  const std::string bytes = BytesOf(kept[0]);
  grpc::ClientContext context;
  v1::ImportClothsResponse answer;
  const auto stream = stub->ImportCloths(&context, &answer);
  v1::ImportClothsRequest request;
  request.mutable_begin()->set_session(session);
  request.mutable_begin()->set_total_bytes(bytes.size());
  stream->Write(request);
  request.set_data(bytes);
  stream->Write(request);
  stream->WritesDone();
  ASSERT_TRUE(stream->Finish().ok());
  EXPECT_EQ(answer.cloth_ids_size(), 1);
}

TEST_F(Checkpoints, AServerWithoutTokensSaysThatItHasSessionsOfTenants) {
  const std::string tokens = dir_ / "tokens", token = "0123456789abcdef0123456789abcdef";
  std::ofstream(tokens) << "lab " << HexOf(api::Sha256Of(token)) << "\n";
  {
    ServerProcess server({"--backend=cpu", "--checkpoint-dir=" + folder_, "--token-file=" + tokens,
                          "--checkpoint-interval-s=3600"});
    ASSERT_TRUE(server.WaitUntilUp());
    grpc::ClientContext context;
    context.AddMetadata("authorization", "Bearer " + token);
    v1::Session session;
    const grpc::Status status =
        server.NewStub()->CreateSession(&context, v1::CreateSessionRequest(), &session);
    ASSERT_TRUE(status.ok()) << status.error_message();
    server.Signal(SIGTERM);
    ASSERT_EQ(server.WaitForExit(), 0) << server.Log();
  }
  const auto server = StartServer();
  EXPECT_THAT(server->Log(), HasSubstr("sessions_unreachable count=1"));
  EXPECT_THAT(server->Log(), HasSubstr("no --token-file"));
}

TEST_F(Checkpoints, DamagedFilesAreSetAsideAndTheOthersComeBack) {
  auto server = StartServer();
  auto stub = server->NewStub();
  const std::string first = NewSession(*stub), second = NewSession(*stub);
  Create(*stub, HangingSheet(first, 4));
  Create(*stub, HangingSheet(second, 4));
  server->Signal(SIGTERM);
  ASSERT_EQ(server->WaitForExit(), 0);
  const auto files = FilesOf(folder_, ".checkpoint");
  ASSERT_EQ(files.size(), 2u);
  std::string bytes = BytesOf(files[0]);
  bytes[bytes.size() / 2] ^= 1;
  std::ofstream(files[0], std::ios::binary) << bytes;
  std::ofstream(folder_ + "/junk.checkpoint") << "no checkpoint";
  std::ofstream(folder_ + "/empty.checkpoint");

  server = StartServer();
  stub = server->NewStub();
  int found = 0;
  for (const std::string& name : {first, second}) {
    v1::GetSessionRequest get;
    get.set_name(name);
    found += Call(*stub, &Stub::GetSession, get).status.ok();
  }
  EXPECT_EQ(found, 1);
  EXPECT_THAT(server->Log(), HasSubstr("session_lost"));
  EXPECT_THAT(server->Log(), HasSubstr("SNAPSHOT_DAMAGED"));
  EXPECT_EQ(FilesOf(folder_, ".unreadable").size(), 3u);
  EXPECT_THAT(server->Log(), testing::Not(HasSubstr("FILE_FAILED")));
}

bool IsThere(Stub& stub, const std::string& session) {
  v1::GetSessionRequest get;
  get.set_name(session);
  return Call(stub, &Stub::GetSession, get).status.ok();
}

TEST_F(Checkpoints, ASessionThatCameBackAndThenEndsIsForgotten) {
  auto server = StartServer();
  auto stub = server->NewStub();
  const std::string session = NewSession(*stub), other = NewSession(*stub);
  Create(*stub, HangingSheet(session, 4));
  server->Signal(SIGTERM);
  ASSERT_EQ(server->WaitForExit(), 0);

  server = StartServer();
  stub = server->NewStub();
  v1::DeleteSessionRequest deletion;
  deletion.set_name(session);
  ASSERT_TRUE(Call(*stub, &Stub::DeleteSession, deletion).status.ok());
  EXPECT_TRUE(Wait([&] { return FilesOf(folder_, ".checkpoint").size() == 1; }));
  server->Signal(SIGKILL);
  server->WaitForExit();

  server = StartServer();
  stub = server->NewStub();
  EXPECT_FALSE(IsThere(*stub, session));
  EXPECT_TRUE(IsThere(*stub, other));
}

TEST_F(Checkpoints, FilesThatCouldNotBeRecoveredNowStayForTheNextStart) {
  auto server = StartServer();
  auto stub = server->NewStub();
  const std::string first = NewSession(*stub), second = NewSession(*stub);
  server->Signal(SIGTERM);
  ASSERT_EQ(server->WaitForExit(), 0);
  // No file that can be read, whoever reads.
  const std::string nothing = folder_ + "/nothing.checkpoint";
  fs::create_directory(nothing);

  {
    ServerProcess narrow({"--backend=cpu", "--checkpoint-dir=" + folder_,
                          "--checkpoint-interval-s=0.1", "--max-sessions=1"});
    ASSERT_TRUE(narrow.WaitUntilUp());
    stub = narrow.NewStub();
    EXPECT_EQ(IsThere(*stub, first) + IsThere(*stub, second), 1);
    EXPECT_THAT(narrow.Log(), HasSubstr("TOO_MANY_SESSIONS"));
    EXPECT_THAT(narrow.Log(), HasSubstr("FILE_FAILED"));
    std::this_thread::sleep_for(std::chrono::milliseconds(500));  // some rounds
    EXPECT_EQ(FilesOf(folder_, ".checkpoint").size(), 3u);
    narrow.Signal(SIGTERM);
    ASSERT_EQ(narrow.WaitForExit(), 0);
  }
  EXPECT_EQ(FilesOf(folder_, ".checkpoint").size(), 3u);

  server = StartServer();
  stub = server->NewStub();
  EXPECT_TRUE(IsThere(*stub, first));
  EXPECT_TRUE(IsThere(*stub, second));
  EXPECT_TRUE(fs::exists(nothing));
}

TEST_F(Checkpoints, AFolderServesOneServerAndALostOneStopsNobody) {
  auto server = StartServer();
  ServerProcess second({"--backend=cpu", "--checkpoint-dir=" + folder_});
  EXPECT_NE(second.WaitForExit(), 0);
  EXPECT_THAT(second.Log(), HasSubstr("FOLDER_IN_USE"));
  ServerProcess nowhere({"--backend=cpu", "--checkpoint-dir=/dev/null/x"});
  EXPECT_NE(nowhere.WaitForExit(), 0);
  EXPECT_THAT(nowhere.Log(), HasSubstr("FILE_FAILED"));

  auto stub = server->NewStub();
  const std::string session = NewSession(*stub);
  const Ids ids = Create(*stub, HangingSheet(session, 4));
  EXPECT_TRUE(Wait([&] {  // a file may appear meanwhile
    std::error_code not_empty;
    fs::remove_all(folder_, not_empty);
    return !fs::exists(folder_);
  }));
  Step(*stub, StepsOf(session, ids, 3));
  EXPECT_TRUE(Wait([&] { return server->Log().find("checkpoint_failed") != std::string::npos; }));
  Step(*stub, StepsOf(session, ids, 3));
}

// A full disk, as far as a limit on the size of files is one.
TEST_F(Checkpoints, AFileThatDoesNotFitLeavesTheOlderOne) {
  const std::string path = dir_ / "file";
  ASSERT_TRUE(WriteDurably(path, "old").ok());
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit small{1000, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Status status = WriteDurably(path, std::string(10'000, 'x'));
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  std::signal(SIGXFSZ, handler);
  EXPECT_EQ(status.reason(), "FILE_FAILED");
  EXPECT_EQ(BytesOf(path), "old");
  EXPECT_FALSE(fs::exists(path + ".draft"));
  ASSERT_TRUE(WriteDurably(path, std::string(10'000, 'x')).ok());
  EXPECT_EQ(BytesOf(path).size(), 10'000u);
}

}  // namespace
}  // namespace drape::test
