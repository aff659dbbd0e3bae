#include "server/api/checkpoint_file.h"

#include <utility>

#include "drape/v1/checkpoint_file.pb.h"
#include "server/api/sha256.h"
#include "server/api/snapshot_records.h"
#include "server/api/snapshot_writing.h"

namespace drape::api {
namespace {

constexpr uint32_t kCheckpointVersion = 1;

v1::SessionCheckpoint MessageOf(const FormerSession& session) {
  v1::SessionCheckpoint message;
  message.set_version(kCheckpointVersion);
  message.set_session(session.name);
  message.set_display_name(session.display_name);
  message.set_tenant(session.tenant);
  message.set_ttl_s(session.ttl_s);
  message.set_id_origin(session.issued.origin.Packed());
  message.mutable_generations()->Add(session.issued.generations.begin(),
                                     session.issued.generations.end());
  message.set_returns(session.issued.returns);
  return message;
}

}  // namespace

Result<CheckpointBytes> WriteCheckpoint(const FormerSession& session, const SavedStates& saved,
                                        const BackendDescription& backend,
                                        const std::string& version, const CheckpointStamp& stamp) {
  v1::SessionCheckpoint head = MessageOf(session);
  DRAPE_ASSIGN_OR_RETURN(const std::string snapshot, WriteSnapshot(saved, backend, version));
  Sha256 digest;
  digest.Add(head.SerializeAsString());
  digest.Add(snapshot);
  head.set_written_unix_s(stamp.written_unix_s);
  head.set_incarnation(stamp.incarnation);
  head.set_start(stamp.start);
  SnapshotWriter writer;
  DRAPE_RETURN_IF_ERROR(writer.Add(head));
  return CheckpointBytes{writer.Take() + snapshot, digest.Finish()};
}

Result<CheckpointHead> ReadCheckpointHead(std::string_view bytes) {
  SnapshotReader reader(bytes);
  DRAPE_RETURN_IF_ERROR(reader.Begin());
  v1::SessionCheckpoint message;
  DRAPE_RETURN_IF_ERROR(reader.Read(message));
  if (message.version() > kCheckpointVersion) {
    return Status(StatusCode::kFailedPrecondition, "SNAPSHOT_TOO_NEW",
                  "the checkpoint has format " + std::to_string(message.version()) +
                      "; this server reads formats up to " + std::to_string(kCheckpointVersion));
  }
  CheckpointHead head;
  head.session = {message.session(),
                  message.display_name(),
                  message.ttl_s(),
                  message.tenant(),
                  {ClothId::FromPacked(message.id_origin()),
                   {message.generations().begin(), message.generations().end()},
                   message.returns()}};
  head.stamp = {message.incarnation(), message.written_unix_s(), message.start()};
  head.snapshot = reader.rest();
  return head;
}

}  // namespace drape::api
