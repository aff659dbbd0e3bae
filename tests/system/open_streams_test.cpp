// Streams that do nothing: how many a client may have open.
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "server/api/sha256.h"
#include "server/api/stranger_streams.h"
#include "server/core/text.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

// Calls of one method that send one message, or none, and stay open as long as this exists.
class OpenStreams {
 public:
  OpenStreams(const std::shared_ptr<grpc::Channel>& channel, std::string method,
              const std::string& token)
      : stub_(channel), method_(std::move(method)), token_(token) {}
  ~OpenStreams() {
    for (const auto& stream : streams_) stream->context.TryCancel();
    queue_.Shutdown();
    void* tag = nullptr;
    for (bool ok = false; queue_.Next(&tag, &ok);) {
    }
  }

  void Open(bool sends = false) {
    Stream& stream = *streams_.emplace_back(std::make_unique<Stream>());
    if (!token_.empty()) stream.context.AddMetadata("authorization", token_);
    stream.call = stub_.PrepareCall(&stream.context, method_, &queue_);
    stream.call->StartCall(nullptr);
    void* tag = nullptr;
    bool ok = false;
    queue_.Next(&tag, &ok);
    if (sends) {
      const grpc::Slice empty;
      stream.call->Write(grpc::ByteBuffer(&empty, 1), nullptr);
      queue_.Next(&tag, &ok);
    }
    stream.call->Finish(&stream.status, &stream);
  }
  // Of those that end: how, one after the other, until `count` have.
  std::vector<grpc::Status> Ends(size_t count) {
    std::vector<grpc::Status> ends;
    void* tag = nullptr;
    for (bool ok = false; ends.size() < count && queue_.Next(&tag, &ok);) {
      ends.push_back(static_cast<Stream*>(tag)->status);
    }
    return ends;
  }
  // Whether another one ends within a moment.
  bool DoesOneEnd() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.AsyncNext(&tag, &ok,
                            std::chrono::system_clock::now() + std::chrono::milliseconds(300)) ==
           grpc::CompletionQueue::GOT_EVENT;
  }

 private:
  struct Stream {
    grpc::ClientContext context;
    std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call;
    grpc::Status status;
  };

  grpc::CompletionQueue queue_;
  grpc::GenericStub stub_;
  const std::string method_, token_;
  std::vector<std::unique_ptr<Stream>> streams_;
};

class OpenStreamsOfTenants : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    std::ofstream(dir_ / "tokens")
        << "one " << HexOf(api::Sha256Of("1")) << "\ntwo " << HexOf(api::Sha256Of("2")) << "\n";
    server_ = std::make_unique<ServerProcess>(
        std::vector<std::string>{"--token-file=" + (dir_ / "tokens"), "--max-streams=8"});
    ASSERT_TRUE(server_->WaitUntilUp());
  }
  ScratchDir dir_;
  std::unique_ptr<ServerProcess> server_;
};

INSTANTIATE_TEST_SUITE_P(Methods, OpenStreamsOfTenants,
                         testing::Values("StepStream", "StreamStates", "Run", "ImportCloths"));

TEST_P(OpenStreamsOfTenants, ATenantLeavesSomeToOthers) {
  const std::string method = std::string("/drape.v1.SimulationService/") + GetParam();
  auto one = std::make_unique<OpenStreams>(server_->NewChannel(), method, "Bearer 1");
  for (int k = 0; k < 7; ++k) one->Open();
  for (const grpc::Status& end : one->Ends(3)) {
    EXPECT_EQ(end.error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED) << end.error_message();
    EXPECT_EQ(ReasonOf(end), "TOO_MANY_STREAMS");
  }
  EXPECT_FALSE(one->DoesOneEnd());
  OpenStreams two(server_->NewChannel(), method, "Bearer 2");
  two.Open();
  EXPECT_FALSE(two.DoesOneEnd());
  // What was open leaves room.
  one = nullptr;
  for (int k = 0; k < 100; ++k) {
    OpenStreams again(server_->NewChannel(), method, "Bearer 1");
    again.Open();
    if (!again.DoesOneEnd()) return;
  }
  FAIL() << "places are not given back";
}

// Health and reflection need no token.
TEST(StreamsOfStrangers, AConnectionHasAFew) {
  ServerProcess server;
  ASSERT_TRUE(server.WaitUntilUp());
  const char* const methods[] = {"/grpc.health.v1.Health/Watch",
                                 "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo"};
  for (const std::string method : methods) {
    SCOPED_TRACE(method);
    const bool is_watch = method.find("Watch") != std::string::npos;
    OpenStreams streams(server.NewChannel(), method, "");
    for (uint32_t k = 0; k < api::kStrangerStreamsPerConnection + 5; ++k) streams.Open(is_watch);
    EXPECT_EQ(streams.Ends(5).size(), 5u);
    EXPECT_FALSE(streams.DoesOneEnd());
    OpenStreams others(server.NewChannel(), method, "");
    others.Open(is_watch);
    EXPECT_FALSE(others.DoesOneEnd());
  }
}

}  // namespace
}  // namespace drape::test
