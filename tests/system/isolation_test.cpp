// Every method of the service, asked for what is another tenant's: it is not there. The methods
// come from the descriptor, so that none can be forgotten.
#include <google/protobuf/text_format.h>
#include <grpcpp/completion_queue.h>
#include <grpcpp/generic/generic_stub.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "server/api/sha256.h"
#include "server/core/text.h"
#include "tests/system/calls.h"
#include "tests/system/server_process.h"

namespace drape::test {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::MethodDescriptor;

const std::string kMine = "Bearer one-token", kTheirs = "Bearer two-token";

// These know no session.
const std::set<std::string> kWithoutSession = {"CreateSession", "ListSessions", "GetServerInfo"};

// What a request needs beside its session and its cloths to be a good one, as protobuf text.
std::string RestOf(const std::string& method) {
  static const std::map<std::string, std::string> rests = {
      {"CreateCloths", "spec { grid { columns: 4 rows: 4 width_m: 1 height_m: 1 } }"},
      {"UpdateCloths",
       "spec { material { air_drag: 1 } } update_mask { paths: 'material.air_drag' }"},
      {"Step", "steps: 1"},
      {"StepInChunks", "steps: 1 in_chunks: true"},
      {"StepStream", "steps: 1"},
      {"Run", "start { steps_hz: 1000 max_steps: 1 }"},
      {"ReadStates", "view { positions: true }"},
      {"StreamStates", "subscribe { view { positions: true } every_n_steps: 1 }"},
      {"SaveStates", "name: 'kept'"},
      {"LoadStates", "name: 'kept'"},
      {"DropStates", "name: 'kept'"},
      {"ExportCloths", "name: 'kept'"},
      {"ImportCloths", "begin { total_bytes: 1 }"},
  };
  const auto found = rests.find(method);
  return found == rests.end() ? "" : found->second;
}

// Puts session and cloth where the request, or the part of it that is set, has a place for them.
// False: it has none for a session.
bool Name(Message& request, const std::string& session, uint64_t cloth) {
  const auto* const fields = request.GetReflection();
  const auto* const type = request.GetDescriptor();
  const FieldDescriptor* name = type->FindFieldByName("session");
  if (name == nullptr) name = type->field_count() == 1 ? type->FindFieldByName("name") : nullptr;
  if (name == nullptr) {
    std::vector<const FieldDescriptor*> parts;
    fields->ListFields(request, &parts);
    for (const FieldDescriptor* part : parts) {
      if (part->message_type() == nullptr || part->is_repeated()) continue;
      if (Name(*fields->MutableMessage(&request, part), session, cloth)) return true;
    }
    return false;
  }
  fields->SetString(&request, name, session);
  if (const auto* const ids = type->FindFieldByName("cloth_ids")) {
    fields->AddUInt64(&request, ids, cloth);
  }
  if (const auto* const id = type->FindFieldByName("cloth_id")) {
    fields->SetUInt64(&request, id, cloth);
  }
  return true;
}

// A request of the method that is good but for whose session and cloth it names.
std::unique_ptr<Message> RequestOf(const MethodDescriptor& method, const std::string& session,
                                   uint64_t cloth) {
  std::unique_ptr<Message> request(google::protobuf::MessageFactory::generated_factory()
                                       ->GetPrototype(method.input_type())
                                       ->New());
  EXPECT_TRUE(google::protobuf::TextFormat::ParseFromString(RestOf(method.name()), request.get()));
  EXPECT_TRUE(Name(*request, session, cloth))
      << method.name() << " has no session: does it belong into kWithoutSession?";
  if (auto* const write = dynamic_cast<v1::WriteStatesRequest*>(request.get())) {
    v1::PackedArray& positions = *write->mutable_positions_m();
    positions.set_data_type(v1::PackedArray::FLOAT32);
    positions.add_shape(16);
    positions.add_shape(3);
    positions.set_data(std::string(16 * 3 * sizeof(float), '\0'));
  }
  return request;
}

class Isolation : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream file(dir_ / "tokens");
    for (const std::string name : {"one", "two"}) {
      file << name << " " << HexOf(api::Sha256Of(name + "-token")) << "\n";
    }
    file.close();
    server_ = std::make_unique<ServerProcess>(std::vector{"--token-file=" + (dir_ / "tokens")});
    ASSERT_TRUE(server_->WaitUntilUp());
    stub_ = server_->NewStub();
    generic_ = std::make_unique<grpc::GenericStub>(server_->NewChannel());
    mine_ = NewSession(kMine);
    theirs_ = NewSession(kTheirs);
    my_cloth_ = NewCloth(kMine, mine_);
    their_cloth_ = NewCloth(kTheirs, theirs_);
  }

  std::string NewSession(const std::string& token) {
    return Call(*stub_, &Stub::CreateSession, v1::CreateSessionRequest(), token).value.name();
  }
  uint64_t NewCloth(const std::string& token, const std::string& session) {
    const auto created = Call(*stub_, &Stub::CreateCloths, HangingSheet(session, 4), token);
    EXPECT_TRUE(created.status.ok()) << created.status.error_message();
    v1::SaveStatesRequest save;
    save.set_session(session);
    save.set_name("kept");
    save.set_all_cloths(true);
    EXPECT_TRUE(Call(*stub_, &Stub::SaveStates, save, token).status.ok());
    return created.value.cloth_ids(0);
  }

  // How a call of any kind ends that sends this one message, and reads what comes.
  grpc::Status Send(const MethodDescriptor& method, const Message& request,
                    const std::string& token) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    context.AddMetadata("authorization", token);
    grpc::CompletionQueue queue;
    const auto call = generic_->PrepareCall(
        &context, "/" + method.service()->full_name() + "/" + method.name(), &queue);
    void* tag = nullptr;
    bool ok = false;
    const auto wait = [&] { return queue.Next(&tag, &ok) && ok; };
    const std::string text = request.SerializeAsString();
    const grpc::Slice slice(text);
    call->StartCall(nullptr);
    if (wait()) call->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), nullptr);
    bool is_open = wait();
    while (is_open) {
      grpc::ByteBuffer answer;
      call->Read(&answer, nullptr);
      is_open = wait();
    }
    grpc::Status status;
    call->Finish(&status, nullptr);
    wait();
    return status;
  }

  template <class Look>
  void ForEachMethod(Look look) {
    const auto* const service =
        google::protobuf::DescriptorPool::generated_pool()->FindServiceByName(
            "drape.v1.SimulationService");
    ASSERT_NE(service, nullptr);
    for (int k = 0; k < service->method_count(); ++k) {
      if (kWithoutSession.contains(service->method(k)->name())) continue;
      SCOPED_TRACE(service->method(k)->name());
      look(*service->method(k));
    }
  }

  // What they see of what is theirs.
  std::string Seen() {
    v1::GetClothRequest request;
    request.set_session(theirs_);
    request.set_cloth_id(their_cloth_);
    const auto cloth = Call(*stub_, &Stub::GetCloth, request, kTheirs);
    EXPECT_TRUE(cloth.status.ok()) << cloth.status.error_message();
    return cloth.value.DebugString();
  }

  ScratchDir dir_;
  std::unique_ptr<ServerProcess> server_;
  std::unique_ptr<Stub> stub_;
  std::unique_ptr<grpc::GenericStub> generic_;
  std::string mine_, theirs_;
  uint64_t my_cloth_ = 0, their_cloth_ = 0;
};

// As if there were none: code, reason and text tell nothing.
TEST_F(Isolation, AnotherTenantsSessionIsNotThereInAnyMethod) {
  const std::string before = Seen();
  std::string nobodys = theirs_;
  nobodys.back() = nobodys.back() == '0' ? '1' : '0';
  ForEachMethod([&](const MethodDescriptor& method) {
    const auto ask = [&](const std::string& session) {
      return Send(method, *RequestOf(method, session, their_cloth_), kMine);
    };
    const grpc::Status theirs = ask(theirs_), none = ask(nobodys);
    EXPECT_EQ(theirs.error_code(), grpc::StatusCode::NOT_FOUND) << theirs.error_message();
    EXPECT_EQ(ReasonOf(theirs), "SESSION_NOT_FOUND");
    EXPECT_EQ(theirs.error_message(), none.error_message());
    EXPECT_EQ(theirs.error_details(), none.error_details());
  });
  EXPECT_EQ(Seen(), before);
}

TEST_F(Isolation, AnotherTenantsClothIsNotThereInAnyMethod) {
  const std::string before = Seen();
  ForEachMethod([&](const MethodDescriptor& method) {
    const auto request = RequestOf(method, mine_, their_cloth_);
    if (request->DebugString().find(std::to_string(their_cloth_)) == std::string::npos) return;
    const grpc::Status status = Send(method, *request, kMine);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::NOT_FOUND) << status.error_message();
    EXPECT_EQ(ReasonOf(status), "CLOTH_NOT_FOUND");
  });
  EXPECT_EQ(Seen(), before);
}

// The requests are good: whose session it is gets what it asks for. What ends the session, or what
// it needs, comes last.
TEST_F(Isolation, TheSameRequestsServeTheirOwner) {
  std::vector<const MethodDescriptor*> last;
  const auto serve = [&](const MethodDescriptor& method) {
    SCOPED_TRACE(method.name());
    const grpc::Status status = Send(method, *RequestOf(method, theirs_, their_cloth_), kTheirs);
    if (method.name() == "ImportCloths") {  // of one byte
      EXPECT_EQ(ReasonOf(status), "SNAPSHOT_DAMAGED");
    } else {
      EXPECT_TRUE(status.ok()) << ReasonOf(status) << ": " << status.error_message();
    }
  };
  ForEachMethod([&](const MethodDescriptor& method) {
    const std::set<std::string> ends = {"DropStates", "DeleteCloths", "DeleteSession"};
    if (ends.contains(method.name())) return last.push_back(&method);
    serve(method);
  });
  ASSERT_EQ(last.size(), 3u);
  for (const auto* const name : {"DropStates", "DeleteCloths", "DeleteSession"}) {
    for (const MethodDescriptor* method : last) {
      if (method->name() == name) serve(*method);
    }
  }
}

}  // namespace
}  // namespace drape::test
