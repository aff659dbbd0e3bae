// Streams: pipelined steps, chunks, frames against credits, and clients that vanish.
#include <gmock/gmock.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>

#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using std::chrono::milliseconds;

class Streams : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(server_.WaitUntilUp());
    stub_ = server_.NewStub();
    session_ = NewSession(*stub_);
  }

  v1::StreamStatesRequest Subscription(uint32_t initial_credit) const {
    v1::StreamStatesRequest request;
    request.mutable_subscribe()->set_session(session_);
    request.mutable_subscribe()->set_all_cloths(true);
    request.mutable_subscribe()->set_initial_credit(initial_credit);
    return request;
  }
  static v1::StreamStatesRequest Credit(uint32_t frames) {
    v1::StreamStatesRequest request;
    request.set_credit(frames);
    return request;
  }
  static v1::StreamStatesRequest Pause(bool is_paused) {
    v1::StreamStatesRequest request;
    request.set_pause(is_paused);
    return request;
  }

  ServerProcess server_{{"--reap-interval-ms=10"}};
  std::unique_ptr<Stub> stub_;
  std::string session_;
};

TEST_F(Streams, StepRequestsAreAnsweredInOrder) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 2));
  grpc::ClientContext context;
  const auto stream = stub_->StepStream(&context);
  // More than may be under way at once; short and long ones of different cloths overtake one
  // another on the device, but not in the answers.
  constexpr uint64_t kRequests = 40;
  for (uint64_t k = 0; k < kRequests; ++k) {
    ASSERT_TRUE(stream->Write(StepsOf(session_, {ids[k % 2]}, k % 2 == 0 ? 20 : 1)));
  }
  stream->WritesDone();
  v1::StepResponse response;
  for (uint64_t k = 0; k < kRequests; ++k) {
    ASSERT_TRUE(stream->Read(&response));
    EXPECT_EQ(response.cloth_ids(0), ids[k % 2]);
    EXPECT_EQ(response.steps(0), (k / 2 + 1) * (k % 2 == 0 ? 20 : 1));
  }
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Streams, AFailedStepRequestEndsTheStreamWithItsStatus) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  grpc::ClientContext context;
  const auto stream = stub_->StepStream(&context);
  ASSERT_TRUE(stream->Write(StepsOf(session_, ids, 2)));
  v1::StepRequest mismatch = StepsOf(session_, ids, 1);
  mismatch.set_expected_step(77);
  ASSERT_TRUE(stream->Write(mismatch));
  v1::StepResponse response;
  ASSERT_TRUE(stream->Read(&response)) << "answers before the error are delivered";
  EXPECT_EQ(response.steps(0), 2u);
  EXPECT_FALSE(stream->Read(&response));
  const grpc::Status status = stream->Finish();
  EXPECT_EQ(status.error_code(), grpc::StatusCode::FAILED_PRECONDITION);
  EXPECT_EQ(ReasonOf(status), "STEP_MISMATCH");
  EXPECT_EQ(Step(*stub_, StepsOf(session_, ids, 1)).steps(0), 3u);
}

// The request under way stops: nobody waits for it any more.
TEST_F(Streams, AClientThatVanishesFromAStepStreamFreesItsCloth) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 32));
  {
    grpc::ClientContext context;
    const auto stream = stub_->StepStream(&context);
    ASSERT_TRUE(stream->Write(StepsOf(session_, ids, 1000000)));
    ASSERT_TRUE(stream->Write(StepsOf(session_, ids, 1000000)));
    while (Get(*stub_, session_, ids[0]).step() == 0) std::this_thread::yield();
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  // Waits behind whatever is left of the stream's requests: 2 million steps would not end in time.
  const v1::StepResponse response = Step(*stub_, StepsOf(session_, ids, 1));
  EXPECT_LT(response.steps(0), 1000000u);
}

TEST_F(Streams, AClientThatVanishesFromAUnaryStepFreesItsCloth) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 32));
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + milliseconds(100));
  v1::StepResponse response;
  EXPECT_EQ(stub_->Step(&context, StepsOf(session_, ids, 1000000), &response).error_code(),
            grpc::StatusCode::DEADLINE_EXCEEDED);
  EXPECT_LT(Step(*stub_, StepsOf(session_, ids, 1)).steps(0), 1000000u);
}

// A subscription keeps its session alive; when its client vanishes the lease runs out.
TEST_F(Streams, AClientThatVanishesFromStreamStatesFreesItsSession) {
  session_ = NewSession(*stub_, 1);
  Create(*stub_, HangingSheet(session_));
  v1::GetSessionRequest get;  // does not renew the lease
  get.set_name(session_);
  {
    grpc::ClientContext context;
    const auto stream = stub_->StreamStates(&context);
    ASSERT_TRUE(stream->Write(Subscription(1)));
    v1::StateChunk chunk;
    ASSERT_TRUE(stream->Read(&chunk));
    std::this_thread::sleep_for(milliseconds(1500));
    EXPECT_TRUE(Call(*stub_, &Stub::GetSession, get).status.ok());
    context.TryCancel();
    stream->Finish();
  }
  // The session ends when its lease does, its cloths a moment later; 20 s are a generous limit.
  grpc::Status status;
  uint32_t cloth_count = 1;
  for (int k = 0; k < 2000 && (status.ok() || cloth_count > 0); ++k) {
    std::this_thread::sleep_for(milliseconds(10));
    status = Call(*stub_, &Stub::GetSession, get).status;
    const auto info = Call(*stub_, &Stub::GetServerInfo, v1::GetServerInfoRequest());
    cloth_count = info.value.cloth_count();
  }
  EXPECT_EQ(ReasonOf(status), "SESSION_EXPIRED");
  EXPECT_EQ(cloth_count, 0u);
}

// The server has begun to end the stream when its client vanishes: the rest of the frame in flight,
// larger than what is sent without flow control, cannot be written.
TEST_F(Streams, AClientThatVanishesAfterItsLastMessageHarmsNobody) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 128));
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
  // Otherwise the flow control window grows with the speed of the connection.
  arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
  const auto stub = v1::SimulationService::NewStub(
      grpc::CreateCustomChannel(server_.Address(), grpc::InsecureChannelCredentials(), arguments));
  for (int k = 0; k < 10; ++k) {
    grpc::ClientContext context;
    const auto stream = stub->StreamStates(&context);
    ASSERT_TRUE(stream->Write(Subscription(1))) << server_.Log();
    stream->WaitForInitialMetadata();  // leaves the server with the frame
    stream->WritesDone();
    std::this_thread::sleep_for(milliseconds(50));  // it has arrived
    context.TryCancel();
    EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  std::this_thread::sleep_for(milliseconds(100));  // time to react to the lost client
  ASSERT_TRUE(server_.is_running()) << server_.Log();
  EXPECT_EQ(Step(*stub_, StepsOf(session_, ids, 1)).steps(0), 1u);
}

TEST_F(Streams, FramesComeAgainstCreditsAndTheLatestWins) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  grpc::ClientContext context;
  const auto stream = stub_->StreamStates(&context);
  ASSERT_TRUE(stream->Write(Subscription(1)));
  v1::StateChunk chunk;
  ASSERT_TRUE(stream->Read(&chunk));
  EXPECT_EQ(chunk.frame(), 1u);
  EXPECT_EQ(chunk.steps(0), 0u) << "the first frame shows the state at subscribing";
  // Without credit nothing is sent, however much is stepped; then only the latest state is.
  for (int k = 0; k < 10; ++k) Step(*stub_, StepsOf(session_, ids, 1));
  ASSERT_TRUE(stream->Write(Credit(1)));
  ASSERT_TRUE(stream->Read(&chunk));
  EXPECT_EQ(chunk.frame(), 2u);
  EXPECT_EQ(chunk.steps(0), 10u);
  EXPECT_EQ(chunk.frames_dropped(), 9u);
  EXPECT_TRUE(chunk.is_last());
  stream->WritesDone();
  EXPECT_FALSE(stream->Read(&chunk));
  EXPECT_TRUE(stream->Finish().ok());
}

TEST_F(Streams, PauseHoldsFramesBack) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  grpc::ClientContext context;
  const auto stream = stub_->StreamStates(&context);
  ASSERT_TRUE(stream->Write(Subscription(1)));
  v1::StateChunk chunk;
  ASSERT_TRUE(stream->Read(&chunk));
  ASSERT_TRUE(stream->Write(Pause(true)));
  ASSERT_TRUE(stream->Write(Credit(5)));
  std::this_thread::sleep_for(milliseconds(100));  // both have arrived
  for (int k = 0; k < 3; ++k) Step(*stub_, StepsOf(session_, ids, 1));
  ASSERT_TRUE(stream->Write(Pause(false)));
  ASSERT_TRUE(stream->Read(&chunk));
  EXPECT_EQ(chunk.frame(), 2u);
  EXPECT_EQ(chunk.steps(0), 3u) << "one frame for the whole pause";
  context.TryCancel();
}

TEST_F(Streams, StreamStatesNamesWhatIsWrong) {
  const auto refusal = [&](std::initializer_list<v1::StreamStatesRequest> requests) {
    grpc::ClientContext context;
    const auto stream = stub_->StreamStates(&context);
    for (const auto& request : requests) stream->Write(request);
    v1::StateChunk chunk;
    while (stream->Read(&chunk)) continue;
    return stream->Finish();
  };
  EXPECT_THAT(FieldsOf(refusal({Credit(1)})), testing::ElementsAre("subscribe"));
  EXPECT_THAT(FieldsOf(refusal({v1::StreamStatesRequest()})), testing::ElementsAre("action"));
  EXPECT_EQ(ReasonOf(refusal({Subscription(1)})), "NO_CLOTHS");
  Create(*stub_, HangingSheet(session_));
  EXPECT_THAT(FieldsOf(refusal({Subscription(0), Subscription(0)})),
              testing::ElementsAre("subscribe"));
  v1::StreamStatesRequest stale = Subscription(1);
  stale.mutable_subscribe()->clear_all_cloths();
  EXPECT_THAT(FieldsOf(refusal({stale})), testing::ElementsAre("subscribe.cloth_ids"));
  stale.mutable_subscribe()->add_cloth_ids(42);
  EXPECT_EQ(ReasonOf(refusal({stale})), "CLOTH_NOT_FOUND");
}

// 300 x 300 particles with velocities are 2.2 MB: one cloth over several chunks.
TEST_F(Streams, ChunksStayBelowOneMebibyteAndFitTogether) {
  const Ids small = Create(*stub_, HangingSheet(session_, 4));
  const Ids large = Create(*stub_, HangingSheet(session_, 300));
  const auto chunks = Read(*stub_, session_, {small[0], large[0]});
  EXPECT_GE(chunks.size(), 3u);
  std::map<uint64_t, uint32_t> received;
  for (size_t c = 0; c < chunks.size(); ++c) {
    const v1::StateChunk& chunk = chunks[c];
    EXPECT_LE(chunk.positions_m().data().size() + chunk.velocities_m_per_s().data().size(),
              1u << 20);
    EXPECT_EQ(chunk.is_last(), c + 1 == chunks.size());
    for (int k = 0; k < chunk.cloth_ids_size(); ++k) {
      EXPECT_EQ(chunk.first_particles(k), received[chunk.cloth_ids(k)]);
      received[chunk.cloth_ids(k)] += chunk.particle_counts(k);
    }
  }
  EXPECT_EQ(received[small[0]], 16u);
  EXPECT_EQ(received[large[0]], 90000u);
}

}  // namespace
}  // namespace drape::test
