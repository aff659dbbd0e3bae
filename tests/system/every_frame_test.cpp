// StreamStates with delivery EVERY_FRAME: no frame is missing, and who does not read is ended
// alone.
#include <gmock/gmock.h>
#include <google/rpc/error_details.pb.h>
#include <google/rpc/status.pb.h>
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <thread>

#include "tests/system/calls.h"
#include "tests/system/metrics.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using std::chrono::milliseconds;
using Subscribe = v1::StreamStatesRequest::Subscribe;

// The steps of every cloth in the order of their arrival, and the end of the stream.
struct Received {
  std::map<uint64_t, std::vector<uint64_t>> steps;
  std::vector<uint64_t> frames;
  uint64_t last_step = 0;
  grpc::Status status;
};

std::map<std::string, std::string> MetadataOf(const grpc::Status& status) {
  google::rpc::Status details;
  details.ParseFromString(status.error_details());
  google::rpc::ErrorInfo info;
  for (const auto& detail : details.details()) {
    if (detail.UnpackTo(&info)) break;
  }
  return {info.metadata().begin(), info.metadata().end()};
}

class EveryFrame : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_TRUE(server_.WaitUntilUp());
    stub_ = server_.NewStub();
    session_ = NewSession(*stub_);
  }

  Subscribe Everything() const {
    Subscribe subscribe;
    subscribe.set_session(session_);
    subscribe.set_all_cloths(true);
    subscribe.set_delivery(v1::StreamStatesRequest::EVERY_FRAME);
    return subscribe;
  }

  // A client whose connection does not take more than it was told: who does not read is noticed.
  std::unique_ptr<Stub> StubOfASlowClient() const {
    grpc::ChannelArguments arguments;
    arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);
    arguments.SetInt(GRPC_ARG_HTTP2_BDP_PROBE, 0);
    return v1::SimulationService::NewStub(grpc::CreateCustomChannel(
        server_.Address(), grpc::InsecureChannelCredentials(), arguments));
  }

  ServerProcess server_{{"--metrics-listen=127.0.0.1:0"}};
  std::unique_ptr<Stub> stub_;
  std::string session_;
};

// One subscription, read by hand or by Collect.
class Viewer {
 public:
  Viewer(Stub& stub, const Subscribe& subscribe) : stream_(stub.StreamStates(&context_)) {
    v1::StreamStatesRequest request;
    *request.mutable_subscribe() = subscribe;
    EXPECT_TRUE(stream_->Write(request));
  }
  // Until the first frame has been read: the subscription exists.
  void ReadFirst() { ASSERT_TRUE(ReadFrame()); }
  bool ReadFrame() {
    v1::StateChunk chunk;
    while (stream_->Read(&chunk)) {
      for (int k = 0; k < chunk.cloth_ids_size(); ++k) {
        if (chunk.first_particles(k) > 0) continue;
        received_.steps[chunk.cloth_ids(k)].push_back(chunk.steps(k));
        received_.last_step = chunk.steps(k);
      }
      EXPECT_EQ(chunk.frames_dropped(), 0u);
      if (!chunk.is_last()) continue;
      received_.frames.push_back(chunk.frame());
      return true;
    }
    return false;
  }
  void Send(const v1::StreamStatesRequest& request) { stream_->Write(request); }
  void FinishWriting() { stream_->WritesDone(); }
  Received ReadToTheEnd() {
    while (ReadFrame()) continue;
    received_.status = stream_->Finish();
    return received_;
  }

 private:
  grpc::ClientContext context_;
  std::unique_ptr<grpc::ClientReaderWriter<v1::StreamStatesRequest, v1::StateChunk>> stream_;
  Received received_;
};

std::vector<uint64_t> Multiples(uint64_t of, uint64_t up_to) {
  std::vector<uint64_t> steps;
  for (uint64_t step = 0; step <= up_to; step += of) steps.push_back(step);
  return steps;
}

TEST_F(EveryFrame, NoStepIsMissingWhileSeveralClientsStep) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 3));
  Subscribe thinned = Everything();
  thinned.set_every_n_steps(7);
  // The server reads on although nobody does here: all of them have room in the queue.
  Subscribe roomy = Everything();
  roomy.set_max_queued_frames(2000);
  Viewer all(*stub_, roomy), some(*stub_, thinned);
  all.ReadFirst();
  some.ReadFirst();
  std::vector<std::thread> steppers;
  for (const uint64_t id : ids) {
    steppers.emplace_back([&, id] {
      const auto stub = server_.NewStub();
      for (int k = 0; k < 10; ++k) Step(*stub, StepsOf(session_, {id}, k % 2 == 0 ? 39 : 1));
    });
  }
  for (std::thread& stepper : steppers) stepper.join();
  for (Viewer* viewer : {&all, &some}) viewer->FinishWriting();
  const Received of_all = all.ReadToTheEnd(), of_some = some.ReadToTheEnd();
  EXPECT_TRUE(of_all.status.ok()) << of_all.status.error_message();
  EXPECT_TRUE(of_some.status.ok()) << of_some.status.error_message();
  for (const uint64_t id : ids) {
    EXPECT_EQ(of_all.steps.at(id), Multiples(1, 200));
    EXPECT_EQ(of_some.steps.at(id), Multiples(7, 200));
  }
  for (size_t k = 0; k < of_all.frames.size(); ++k) EXPECT_EQ(of_all.frames[k], k + 1);
}

// Viewers of the same share what is read and encoded, and each has its own numbers.
TEST_F(EveryFrame, IsEncodedOnceForAllWhoSeeTheSame) {
  constexpr uint64_t kViewers = 4, kSteps = 50;
  const Ids ids = Create(*stub_, HangingSheet(session_, 8, 3));
  Viewer early(*stub_, Everything());
  early.ReadFirst();
  Step(*stub_, StepsOf(session_, ids, 1));
  std::vector<std::unique_ptr<Viewer>> viewers;
  for (uint64_t k = 0; k < kViewers; ++k) {
    viewers.push_back(std::make_unique<Viewer>(*stub_, Everything()));
    viewers.back()->ReadFirst();
  }
  Subscribe half = Everything();
  half.mutable_view()->set_encoding(v1::StateView::FLOAT16);
  Viewer other(*stub_, half);
  other.ReadFirst();
  const double encoded_before = MetricIn(MetricsOf(server_), "drape_frames_encoded_total");
  const double sent_before = MetricIn(MetricsOf(server_), "drape_frames_sent_total");
  for (uint64_t k = 0; k < kSteps; ++k) Step(*stub_, StepsOf(session_, ids, 1));
  early.FinishWriting();
  other.FinishWriting();
  for (const auto& viewer : viewers) viewer->FinishWriting();
  const Received of_early = early.ReadToTheEnd(), of_other = other.ReadToTheEnd();
  for (const auto& viewer : viewers) {
    const Received received = viewer->ReadToTheEnd();
    EXPECT_TRUE(received.status.ok()) << received.status.error_message();
    for (const uint64_t id : ids) {
      const std::vector<uint64_t> all = Multiples(1, kSteps + 1);
      EXPECT_EQ(received.steps.at(id), std::vector<uint64_t>(all.begin() + 1, all.end()));
    }
    EXPECT_EQ(received.frames.back(), kSteps + 1);
  }
  EXPECT_EQ(of_early.frames.back(), kSteps + 2);
  EXPECT_EQ(of_other.frames.back(), kSteps + 1);
  const std::string metrics = MetricsOf(server_);
  EXPECT_EQ(MetricIn(metrics, "drape_frames_encoded_total") - encoded_before, 2 * kSteps);
  EXPECT_EQ(MetricIn(metrics, "drape_frames_sent_total") - sent_before, (kViewers + 2) * kSteps);
}

TEST_F(EveryFrame, AClothAsleepIsThereToo) {
  v1::CreateClothsRequest sheet = HangingSheet(session_);
  sheet.mutable_spec()->mutable_environment()->clear_gravity_m_per_s2();
  for (int k = 0; k < 3; ++k) sheet.mutable_spec()->mutable_environment()->add_gravity_m_per_s2(0);
  sheet.mutable_spec()->mutable_settings()->set_sleep_motion_m(1e-3);
  const Ids ids = Create(*stub_, sheet);
  Viewer viewer(*stub_, Everything());
  viewer.ReadFirst();
  v1::StepRequest step = StepsOf(session_, ids, 100);
  step.set_report(true);
  ASSERT_TRUE(Step(*stub_, step).reports(0).asleep());
  viewer.FinishWriting();
  EXPECT_EQ(viewer.ReadToTheEnd().steps.at(ids[0]), Multiples(1, 100));
}

TEST_F(EveryFrame, WhoFallsBehindIsEndedWithWhatItHasGotAndNobodyElse) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 128));  // frames of 196 kB
  const auto slow_stub = StubOfASlowClient();
  Subscribe short_queue = Everything();
  short_queue.set_max_queued_frames(8);
  Viewer stalled(*slow_stub, short_queue);
  stalled.ReadFirst();
  Subscribe roomy = Everything();
  roomy.set_max_queued_bytes(1 << 28);
  Viewer other(*stub_, roomy);
  other.ReadFirst();
  Received of_other;
  std::thread reader([&] { of_other = other.ReadToTheEnd(); });
  constexpr uint64_t kSteps = 60;
  for (uint64_t k = 0; k < kSteps; ++k) Step(*stub_, StepsOf(session_, ids, 1));
  EXPECT_EQ(MetricIn(MetricsOf(server_), "drape_slow_consumers_total"), 1);
  other.FinishWriting();
  reader.join();
  EXPECT_TRUE(of_other.status.ok()) << of_other.status.error_message();
  EXPECT_EQ(of_other.steps.at(ids[0]), Multiples(1, kSteps));

  // What it had not lost comes in order; then the reason, and how far it got.
  const Received of_stalled = stalled.ReadToTheEnd();
  EXPECT_EQ(of_stalled.status.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  EXPECT_EQ(ReasonOf(of_stalled.status), "SLOW_CONSUMER");
  EXPECT_LT(of_stalled.last_step, kSteps);
  EXPECT_EQ(of_stalled.steps.at(ids[0]), Multiples(1, of_stalled.last_step));
  const auto metadata = MetadataOf(of_stalled.status);
  EXPECT_EQ(metadata.at("last_step"), std::to_string(of_stalled.last_step));
  EXPECT_EQ(metadata.at("last_frame"), std::to_string(of_stalled.frames.back()));
}

// The frames that wait are counted from the beginning, whether they are there or not.
TEST_F(EveryFrame, QueuesCountAsUnreadBytesAndAreGivenBack) {
  Create(*stub_, HangingSheet(session_, 64));  // frames of 49 kB
  // gRPC lets go of a call after its answer; 20 s are a generous limit.
  const auto wait_until_nothing_is_held = [&] {
    double held = -1;
    for (int k = 0; k < 2000 && held != 0; ++k) {
      std::this_thread::sleep_for(milliseconds(10));
      held = MetricIn(MetricsOf(server_), "drape_unread_bytes");
    }
    EXPECT_EQ(held, 0);
  };
  wait_until_nothing_is_held();
  {
    Viewer viewer(*stub_, Everything());
    viewer.ReadFirst();
    const double held = MetricIn(MetricsOf(server_), "drape_unread_bytes");
    EXPECT_GT(held, 256 * 64 * 64 * 12);
    EXPECT_LT(held, (16 << 20) + 1000);
    viewer.FinishWriting();
    EXPECT_TRUE(viewer.ReadToTheEnd().status.ok());
  }
  wait_until_nothing_is_held();
  // More than a session may hold besides what it has.
  Subscribe greedy = Everything();
  greedy.set_max_queued_frames(65536);
  greedy.set_max_queued_bytes(1 << 28);
  Viewer first(*stub_, greedy);
  first.ReadFirst();
  Viewer second(*stub_, greedy);
  EXPECT_EQ(ReasonOf(second.ReadToTheEnd().status), "TOO_MANY_UNREAD_BYTES");
}

TEST_F(EveryFrame, CreditsAndPausesAreRefused) {
  Create(*stub_, HangingSheet(session_));
  v1::StreamStatesRequest credit, pause;
  credit.set_credit(1);
  pause.set_pause(true);
  for (const auto& [request, field] : {std::pair(credit, "credit"), std::pair(pause, "pause")}) {
    Viewer viewer(*stub_, Everything());
    viewer.Send(request);
    EXPECT_THAT(FieldsOf(viewer.ReadToTheEnd().status), testing::ElementsAre(field));
  }
}

// A reset begins the steps again.
TEST_F(EveryFrame, ResetsAreSeen) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  Viewer viewer(*stub_, Everything());
  viewer.ReadFirst();
  Step(*stub_, StepsOf(session_, ids, 2));
  v1::ResetClothsRequest reset;
  reset.set_session(session_);
  reset.set_all_cloths(true);
  ASSERT_TRUE(Call(*stub_, &Stub::ResetCloths, reset).status.ok());
  Step(*stub_, StepsOf(session_, ids, 1));
  viewer.FinishWriting();
  EXPECT_THAT(viewer.ReadToTheEnd().steps.at(ids[0]), testing::ElementsAre(0, 1, 2, 0, 1));
}

}  // namespace
}  // namespace drape::test
