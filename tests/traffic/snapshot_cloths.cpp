// A unit of its own: headers of the server and of the client do not go together.
#include "tests/traffic/snapshot_cloths.h"

#include <google/protobuf/util/message_differencer.h>

#include <stdexcept>
#include <vector>

#include "drape/v1/snapshot_file.pb.h"
#include "server/api/snapshot_records.h"

namespace drape::test {

std::map<uint64_t, std::string> WholesIn(const std::string& snapshot) {
  api::SnapshotReader reader(snapshot);
  const auto read = [&](google::protobuf::Message& message) {
    const Status status = reader.Read(message);
    if (!status.ok()) throw std::runtime_error(status.ToString());
  };
  if (!reader.Begin().ok()) throw std::runtime_error("no snapshot");
  v1::SnapshotHeader header;
  read(header);
  if (header.meshes() > 0) throw std::runtime_error("traffic has no meshes as colliders");
  std::vector<uint64_t> models;  // what they contain
  for (uint32_t k = 0; k < header.models(); ++k) {
    v1::ModelSnapshot model;
    read(model);
    models.push_back(model.content_hash());
  }
  std::map<uint64_t, std::string> wholes;
  for (uint32_t k = 0; k < header.cloths(); ++k) {
    v1::ClothSnapshot cloth;
    read(cloth);
    const uint64_t id = cloth.cloth_id();
    const uint64_t model = models.at(cloth.model());
    cloth.set_cloth_id(model);
    cloth.clear_model();
    v1::RuntimeSnapshot& runtime = *cloth.mutable_runtime();
    runtime.clear_sweep_us();
    // A step that is done in pieces has told the backend; who goes on from here tells it again.
    for (auto* motions :
         {runtime.mutable_pins(), runtime.mutable_lengths(), runtime.mutable_colliders(),
          runtime.mutable_grips()->mutable_motions()}) {
      motions->clear_is_settled();
      motions->clear_is_repeated();
    }
    wholes[id] = cloth.SerializeAsString();
  }
  return wholes;
}

std::string DifferenceOf(const std::string& whole, const std::string& other) {
  v1::ClothSnapshot a, b;
  if (!a.ParseFromString(whole) || !b.ParseFromString(other)) return "one of them is no snapshot";
  std::string text;
  google::protobuf::util::MessageDifferencer differencer;
  differencer.ReportDifferencesToString(&text);
  differencer.Compare(a, b);
  return text;
}

}  // namespace drape::test
