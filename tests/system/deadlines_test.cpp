// Calls whose deadline passes while they wait: nothing is done for them.
#include <grpcpp/create_channel.h>
#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "tests/system/calls.h"
#include "tests/system/in_process_server.h"

namespace drape::test {
namespace {

using std::chrono::milliseconds;

class Deadlines : public testing::Test {
 protected:
  static constexpr milliseconds kShort{150};

  // Over TCP, as clients come.
  std::unique_ptr<Stub> NewStub() {
    return v1::SimulationService::NewStub(
        grpc::CreateChannel("127.0.0.1:" + std::to_string(server_.server().port()),
                            grpc::InsecureChannelCredentials()));
  }

  // The status of a call with a deadline that is near.
  template <class Request, class Response>
  grpc::Status Hurried(grpc::Status (Stub::*method)(grpc::ClientContext*, const Request&,
                                                    Response*),
                       const Request& request, milliseconds time = kShort) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + time);
    Response response;
    return (stub_.get()->*method)(&context, request, &response);
  }

  // The client has given up; the server's time is as long, rounded up, but began when the request
  // arrived, perhaps just before the client's ended.
  static void AwaitTheServersDeadline() { std::this_thread::sleep_for(kShort + milliseconds(50)); }
  // Until the server has let go of all step requests.
  void AwaitEmptyQueue() {
    while (server_.scheduler().counters().queued_requests > 0) std::this_thread::yield();
  }

  InProcessServer server_{"cpu"};
  const std::unique_ptr<Stub> stub_ = NewStub();
  const std::string session_ = NewSession(*stub_);
};

TEST_F(Deadlines, AStepThatWaitsTooLongIsNeverDone) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  for (const char* id : {"", "once"}) {
    v1::StepRequest request = StepsOf(session_, ids, 1);
    request.set_request_id(id);
    const v1::Cloth before = Get(*stub_, session_, ids[0]);
    server_.scheduler().HoldForTest();
    EXPECT_EQ(Hurried(&Stub::Step, request).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
    AwaitTheServersDeadline();
    server_.scheduler().ReleaseForTest();
    AwaitEmptyQueue();
    EXPECT_EQ(server_.scheduler().counters().rounds, before.step()) << "no batch";
    EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), before.step());
    // Its repetition is done, also with the same id.
    EXPECT_EQ(Step(*stub_, request).steps(0), before.step() + 1);
  }
}

// A request with an id that has begun is completed for its repetition, whatever the deadline.
TEST_F(Deadlines, AStepWithAnIdThatHasBegunIsCompleted) {
  const Ids ids = Create(*stub_, HangingSheet(session_, 4));
  constexpr uint32_t kSteps = 20'000;  // some time
  v1::StepRequest request = StepsOf(session_, ids, kSteps);
  request.set_request_id("begun");
  auto call = std::async(std::launch::async, [&] {
    return Hurried(&Stub::Step, request, std::chrono::seconds(1)).error_code();
  });
  while (server_.scheduler().counters().rounds == 0) std::this_thread::yield();
  server_.scheduler().HoldForTest();
  EXPECT_EQ(call.get(), grpc::StatusCode::DEADLINE_EXCEEDED);
  server_.scheduler().ReleaseForTest();
  AwaitEmptyQueue();
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), kSteps);
  // The answer is kept a moment after the step has left the queue.
  auto again = Call(*stub_, &Stub::Step, request);
  while (again.status.error_code() == grpc::StatusCode::ABORTED) {
    again = Call(*stub_, &Stub::Step, request);
  }
  ASSERT_TRUE(again.status.ok()) << again.status.error_message();
  EXPECT_EQ(again.value.steps(0), kSteps);
}

TEST_F(Deadlines, AStreamThatWaitsTooLongIsNeverDone) {
  const Ids ids = Create(*stub_, HangingSheet(session_));
  server_.scheduler().HoldForTest();
  grpc::ClientContext context;
  context.set_deadline(std::chrono::system_clock::now() + kShort);
  const auto stream = stub_->StepStream(&context);
  for (int k = 0; k < 3; ++k) {
    v1::StepRequest request = StepsOf(session_, ids, 1);
    request.set_request_id(std::to_string(k));
    stream->Write(request);
  }
  v1::StepResponse response;
  EXPECT_FALSE(stream->Read(&response));
  EXPECT_EQ(stream->Finish().error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  AwaitTheServersDeadline();
  server_.scheduler().ReleaseForTest();
  AwaitEmptyQueue();
  EXPECT_EQ(server_.scheduler().counters().rounds, 0u);
  EXPECT_EQ(Get(*stub_, session_, ids[0]).step(), 0u);
}

TEST_F(Deadlines, AModelThatWaitsTooLongIsNeverBuilt) {
  // Keeps every builder busy.
  std::promise<void> release;
  const std::shared_future<void> released = release.get_future().share();
  std::vector<std::future<void>> busy;
  for (const char* owner : {"a", "b", "c"}) {
    const auto has_begun = std::make_shared<std::promise<void>>();
    busy.push_back(has_begun->get_future());
    ASSERT_TRUE(server_.builders()
                    .Post(owner,
                          [has_begun, released] {
                            has_begun->set_value();
                            released.wait();
                          })
                    .ok());
  }
  for (auto& begun : busy) begun.wait();
  for (const char* id : {"", "once"}) {
    v1::CreateClothsRequest request = HangingSheet(session_);
    request.set_request_id(id);
    EXPECT_EQ(Hurried(&Stub::CreateCloths, request).error_code(),
              grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  AwaitTheServersDeadline();
  release.set_value();
  // Of the same owner, so after them.
  Create(*stub_, HangingSheet(session_));
  v1::GetSessionRequest get;
  get.set_name(session_);
  EXPECT_EQ(Call(*stub_, &Stub::GetSession, get).value.cloth_count(), 1u);
}

// What is read for a picture, and the drawing, are left out: scheduler_test and render_thread_test
// count them. Here: the deadline takes the picture out, and its place is free again.
TEST_F(Deadlines, APictureThatWaitsTooLongFreesItsPlace) {
  Create(*stub_, HangingSheet(session_));
  v1::RenderRequest request;
  request.set_session(session_);
  request.set_all_cloths(true);
  request.set_width_px(64);
  request.set_height_px(64);
  ASSERT_TRUE(Call(*stub_, &Stub::Render, request).status.ok());
  server_.scheduler().HoldForTest();
  // As many as a session may have under way.
  for (int k = 0; k < 4; ++k) {
    EXPECT_EQ(Hurried(&Stub::Render, request).error_code(), grpc::StatusCode::DEADLINE_EXCEEDED);
  }
  server_.scheduler().ReleaseForTest();
  grpc::Status status;
  do {
    status = Call(*stub_, &Stub::Render, request).status;
  } while (ReasonOf(status) == "TOO_MANY_PICTURES");
  EXPECT_TRUE(status.ok()) << status.error_message();
}

}  // namespace
}  // namespace drape::test
