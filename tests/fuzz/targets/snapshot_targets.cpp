// Snapshots and checkpoints: the messages in them, with sound checksums, and their plain bytes.
#include <google/protobuf/empty.pb.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <atomic>
#include <cstring>
#include <future>
#include <memory>
#include <utility>

#include "drape/v1/checkpoint_file.pb.h"
#include "drape/v1/snapshot_file.pb.h"
#include "server/api/checkpoint_file.h"
#include "server/api/request_validation.h"
#include "server/api/snapshot_reading.h"
#include "server/api/snapshot_records.h"
#include "server/api/snapshot_writing.h"
#include "server/core/check.h"
#include "server/session/session_registry.h"
#include "tests/api/requests.h"
#include "tests/fuzz/targets/message_mutator.h"
#include "tests/fuzz/targets/targets.h"
#include "tests/scheduler/fake_backend.h"

namespace drape::test {
namespace {

using google::protobuf::Message;

// The input: each record is its length (4 bytes, little-endian) and a message.
using Records = std::vector<std::string>;
constexpr size_t kLengthBytes = 4;

Records RecordsOf(std::string_view bytes) {
  Records records;
  while (bytes.size() >= kLengthBytes) {
    uint32_t length = 0;
    std::memcpy(&length, bytes.data(), kLengthBytes);
    bytes.remove_prefix(kLengthBytes);
    const std::string_view record = bytes.substr(0, length);
    records.emplace_back(record);
    bytes.remove_prefix(record.size());
  }
  return records;
}

std::string BytesOf(const Records& records) {
  std::string bytes;
  for (const std::string& record : records) {
    const auto length = static_cast<uint32_t>(record.size());
    bytes.append(reinterpret_cast<const char*>(&length), kLengthBytes);
    bytes += record;
  }
  return bytes;
}

// As a server would have written it; empty: a record is no message at all.
std::string WithChecksums(const Records& records) {
  api::SnapshotWriter writer;
  for (const std::string& record : records) {
    google::protobuf::Empty any;  // keeps the fields that it does not know
    if (!any.ParseFromString(record)) return {};
    DRAPE_CHECK(writer.Add(any).ok(), "small");
  }
  return writer.Take();
}

// The records of a snapshot.
Records WithoutChecksums(const std::string& snapshot) {
  Records records;
  api::SnapshotReader reader(snapshot);
  DRAPE_CHECK(reader.Begin().ok(), "a snapshot");
  while (!reader.rest().empty()) {
    google::protobuf::Empty any;
    DRAPE_CHECK(reader.Read(any).ok(), "a record");
    records.push_back(any.SerializeAsString());
  }
  return records;
}

void CheckSnapshotRefusal(const Status& status) {
  DRAPE_CHECK(status.code() == StatusCode::kInvalidArgument ||
                  status.code() == StatusCode::kFailedPrecondition ||
                  status.code() == StatusCode::kResourceExhausted,
              status.ToString());
  DRAPE_CHECK(!status.message().empty() || !status.violations().empty(), "says nothing");
}

// A server on a fake backend.
class World {
 public:
  static World& Get() {
    static World* const world = new World();  // its threads live as long as the process
    return *world;
  }
  SessionRegistry& sessions() { return *registry_; }
  const BackendDescription& backend() const { return scheduler_->description(); }
  const api::RequestLimits& limits() const { return limits_; }
  // Another build's too: the seeds stay good.
  Result<std::vector<SavedCloth>> Read(const std::string& bytes) {
    return api::ReadSnapshot(bytes, {backend(), limits_, nullptr, *reader_, true});
  }
  std::string Write(const SavedStates& saved) {
    return api::WriteSnapshot(saved, backend(), "fuzz").value();
  }
  // Both cloths of the creation, saved.
  std::shared_ptr<const SavedStates> Save(const v1::CreateClothsRequest& request) {
    const api::CheckedCreation checked = api::CheckCreateCloths(request, limits_).value();
    ClothCreation creation{checked.description, SceneModel::Build(*checked.description).value(),
                           checked.pins, checked.copies};
    SessionLease session = registry_->Create(std::nullopt, "fuzz").value();
    std::promise<void> created, saved;
    session->CreateCloths(std::move(creation), [&](const Result<CreatedCloths>& answer) {
      DRAPE_CHECK(answer.ok(), answer.status().ToString());
      created.set_value();
    });
    created.get_future().get();
    session->SaveStates(session->FindCloths({}).value(), "a",
                        [&](const Result<SavedSummary>& answer) {
                          DRAPE_CHECK(answer.ok(), answer.status().ToString());
                          saved.set_value();
                        });
    saved.get_future().get();
    auto states = session->FindSaved("a");
    Delete(session->name());
    return states;
  }
  void Delete(const std::string& name) {
    std::promise<void> done;
    registry_->Delete(name, [&](const Status&) { done.set_value(); });
    done.get_future().get();
  }

 private:
  World() {
    spdlog::set_level(spdlog::level::off);
    limits_.model.max_particles = 1024;
    limits_.model.max_constraints = 8192;
    limits_.max_cloths_per_request = 64;
    scheduler_ = Scheduler::Start(FakeBackendFactory(device_), {}, clock_).value();
    registry_ = std::make_unique<SessionRegistry>(*scheduler_, SessionLimits{}, clock_, "fuzz");
    reader_ = registry_->Create(std::nullopt, "fuzz").value();
  }

  std::shared_ptr<FakeDevice> device_ = std::make_shared<FakeDevice>();
  SteadyClock clock_;
  api::RequestLimits limits_;
  std::unique_ptr<Scheduler> scheduler_;
  std::unique_ptr<SessionRegistry> registry_;
  SessionLease reader_;  // for whom snapshots are read
};

// What was read is written as the same bytes, and those are read as the same again.
FuzzOutcome ReadRecords(std::string_view bytes) {
  const std::string snapshot = WithChecksums(RecordsOf(bytes));
  if (snapshot.empty()) return FuzzOutcome::kUnparsable;
  auto cloths = World::Get().Read(snapshot);
  if (!cloths.ok()) {
    CheckSnapshotRefusal(cloths.status());
    return FuzzOutcome::kRefused;
  }
  const std::string written = World::Get().Write({std::move(*cloths)});
  auto again = World::Get().Read(written);
  DRAPE_CHECK(again.ok(), again.status().ToString());
  DRAPE_CHECK(World::Get().Write({std::move(*again)}) == written, "not the same");
  return FuzzOutcome::kAccepted;
}

FuzzOutcome ReadBytes(std::string_view bytes) {
  const auto cloths = World::Get().Read(std::string(bytes));
  const auto head = api::ReadCheckpointHead(bytes);
  if (!head.ok()) CheckSnapshotRefusal(head.status());
  if (cloths.ok()) return FuzzOutcome::kAccepted;
  CheckSnapshotRefusal(cloths.status());
  return FuzzOutcome::kRefused;
}

std::vector<v1::CreateClothsRequest> SavedCreations() {
  std::vector<v1::CreateClothsRequest> creations(3, GoodCreation());
  creations[0].mutable_spec()->set_max_grips(2);
  Mesh(creations[1]);
  Chain(creations[2]);
  return creations;
}

std::vector<std::string> SnapshotSeeds() {
  std::vector<std::string> seeds;
  for (const v1::CreateClothsRequest& creation : SavedCreations()) {
    seeds.push_back(BytesOf(WithoutChecksums(World::Get().Write(*World::Get().Save(creation)))));
  }
  return seeds;
}

std::unique_ptr<Message> RecordType(const Records& records, size_t number) {
  v1::SnapshotHeader header;
  if (number == 0 || !header.ParseFromString(records[0])) {
    return std::make_unique<v1::SnapshotHeader>();
  }
  if (number <= header.models()) return std::make_unique<v1::ModelSnapshot>();
  if (number <= uint64_t{header.models()} + header.meshes()) return std::make_unique<v1::Mesh>();
  return std::make_unique<v1::ClothSnapshot>();
}

std::string MutateRecords(std::string_view bytes, uint32_t seed) {
  Records records = RecordsOf(bytes);
  if (records.empty()) return {};
  const size_t number = seed % records.size();
  const std::unique_ptr<Message> message = RecordType(records, number);
  if (!message->ParseFromString(records[number])) return {};
  MutateMessage(*message, seed / 7);
  records[number] = message->SerializeAsString();
  return BytesOf(records);
}

v1::SessionCheckpoint GoodCheckpoint() {
  v1::SessionCheckpoint message;
  message.set_version(1);
  message.set_session("sessions/fuzz-00112233445566778899aabbccddeeff");
  message.set_display_name("fuzz");
  message.set_tenant("alice");
  message.set_ttl_s(60);
  message.set_id_origin((ClothId{5, 7}.Packed()));
  for (const uint32_t generation : {7u, 9u, 7u}) message.add_generations(generation);
  message.set_written_unix_s(1e9);
  message.set_incarnation("0123");
  return message;
}

// A session that came back, in which cloths have their ids again, and new ones get others.
FuzzOutcome ReturnSession(std::string_view bytes) {
  v1::SessionCheckpoint message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return FuzzOutcome::kUnparsable;
  }
  static const auto saved = World::Get().Save(SavedCreations()[2]);
  SessionRegistry& sessions = World::Get().sessions();
  const std::string file = WithChecksums({message.SerializeAsString()});
  const auto head = api::ReadCheckpointHead(file);
  if (!head.ok()) {
    CheckSnapshotRefusal(head.status());
    return FuzzOutcome::kRefused;
  }
  Result<SessionLease> session = sessions.Return(head->session);
  if (!session.ok()) {
    CheckSnapshotRefusal(session.status());
    return FuzzOutcome::kRefused;
  }
  std::vector<SavedCloth> cloths = saved->cloths;
  for (uint32_t k = 0; k < cloths.size(); ++k) {
    const ClothId origin = head->session.issued.origin;
    const auto& generations = head->session.issued.generations;
    cloths[k].id = {origin.slot + k,
                    origin.generation + (k < generations.size() ? generations[k] : 0)};
  }
  std::promise<Status> done;
  (*session)->ReturnCloths(std::move(cloths), [&](const Result<std::vector<ClothId>>& ids) {
    done.set_value(ids.status());
  });
  const Status status = done.get_future().get();
  if (!status.ok()) CheckSnapshotRefusal(status);
  const std::string name = (*session)->name(), tenant = (*session)->tenant();
  *session = {};
  std::promise<Status> deleted;
  sessions.Delete(
      name, [&](const Status& s) { deleted.set_value(s); }, tenant);
  DRAPE_CHECK(deleted.get_future().get().ok(), "it was there");
  return status.ok() ? FuzzOutcome::kAccepted : FuzzOutcome::kRefused;
}

std::string MutateCheckpoint(std::string_view bytes, uint32_t seed) {
  v1::SessionCheckpoint message;
  if (!message.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return {};
  MutateMessage(message, seed);
  return message.SerializeAsString();
}

std::vector<std::string> CheckpointSeeds() {
  return {GoodCheckpoint().SerializeAsString()};
}

std::vector<std::string> ByteSeeds() {
  return {World::Get().Write(*World::Get().Save(SavedCreations()[2])),
          WithChecksums({GoodCheckpoint().SerializeAsString()})};
}

}  // namespace

std::vector<FuzzTarget> SnapshotTargets() {
  FuzzTarget snapshot{"snapshot", ReadRecords, SnapshotSeeds, MutateRecords};
  FuzzTarget bytes{"snapshot_bytes", ReadBytes, ByteSeeds};
  FuzzTarget checkpoint{"checkpoint", ReturnSession, CheckpointSeeds, MutateCheckpoint};
  return {std::move(snapshot), std::move(bytes), std::move(checkpoint)};
}

}  // namespace drape::test
