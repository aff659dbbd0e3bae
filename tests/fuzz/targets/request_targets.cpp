// Requests as bytes, through parsing and the validators of server/api.
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>
#include <grpcpp/impl/codegen/proto_utils.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>

#include "server/api/parsed_size.h"
#include "server/api/picture_validation.h"
#include "server/api/request_validation.h"
#include "server/api/run_pace.h"
#include "server/api/state_chunks.h"
#include "server/api/status_mapping.h"
#include "server/api/stream_validation.h"
#include "server/api/written_states.h"
#include "server/core/check.h"
#include "tests/api/requests.h"
#include "tests/fuzz/targets/message_mutator.h"
#include "tests/fuzz/targets/targets.h"

namespace drape::test {
namespace {

// Every refusal names what is wrong, in a size that fits into an answer.
void CheckRefusal(const Status& status) {
  DRAPE_CHECK(status.code() == StatusCode::kInvalidArgument, status.ToString());
  DRAPE_CHECK(!status.violations().empty(), status.ToString());
  for (const FieldViolation& violation : status.violations()) {
    DRAPE_CHECK(!violation.field.empty() || !violation.description.empty(), "says nothing");
  }
  const grpc::Status mapped = api::ToGrpcStatus(status);
  DRAPE_CHECK(mapped.error_message().size() + mapped.error_details().size() < 8000, "too long");
}

// Of requests that `check` accepts or refuses.
template <class Request>
FuzzTarget Target(const std::string& name, std::vector<Request> seeds,
                  std::function<Status(const Request&)> check) {
  FuzzTarget target;
  target.name = name;
  target.run = [check = std::move(check)](std::string_view bytes) {
    Request request;
    google::protobuf::io::ArrayInputStream stream(bytes.data(), static_cast<int>(bytes.size()));
    const uint64_t foretold = api::ParsedSize_bytes(*Request::descriptor(), stream, UINT64_MAX);
    if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
      return FuzzOutcome::kUnparsable;
    }
    DRAPE_CHECK(foretold >= request.SpaceUsedLong(), "takes more memory than was foretold");
    const Status status = check(request);
    if (status.ok()) return FuzzOutcome::kAccepted;
    CheckRefusal(status);
    return FuzzOutcome::kRefused;
  };
  target.seeds = [seeds = std::move(seeds)] {
    std::vector<std::string> texts;
    for (const Request& request : seeds) texts.push_back(request.SerializeAsString());
    return texts;
  };
  target.mutate = [](std::string_view bytes, uint32_t seed) -> std::string {
    Request request;
    if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) return {};
    MutateMessage(request, seed);
    return request.SerializeAsString();
  };
  return target;
}

api::RequestLimits SmallLimits() {
  api::RequestLimits limits;
  limits.model.max_particles = 1024;
  limits.model.max_constraints = 8192;
  limits.max_cloths_per_request = 64;
  return limits;
}

bool IsUnit(const RigidTransform& transform) {
  return std::abs(transform.rotation.norm() - 1) < 1e-12;
}

std::vector<v1::CreateClothsRequest> Creations() {
  std::vector<v1::CreateClothsRequest> creations(4, GoodCreation());
  Mesh(creations[1]);
  Chain(creations[2]);
  AddSolid(creations[3]);
  creations[3].mutable_spec()->mutable_self_collision();
  creations[3].mutable_spec()->set_max_grips(2);
  return creations;
}

// The builder accepts every accepted request, or refuses it with a field of its own.
Status CheckCreation(const v1::CreateClothsRequest& request) {
  const api::RequestLimits limits = SmallLimits();
  const auto checked = api::CheckCreateCloths(request, limits);
  if (!checked.ok()) return checked.status();
  DRAPE_CHECK(checked->copies.size() <= limits.max_cloths_per_request, "too many");
  for (const ClothCopy& copy : checked->copies) {
    const ClothParameters& parameters = copy.parameters;
    DRAPE_CHECK(parameters.gravity_m_per_s2.allFinite(), "gravity");
    DRAPE_CHECK(parameters.wind_m_per_s.allFinite(), "wind");
    DRAPE_CHECK(parameters.air_drag >= 0 && parameters.air_lift >= 0, "air");
    DRAPE_CHECK(IsUnit(copy.transform), "rotation");
  }
  return SceneModel::Build(*checked->description, limits.model).status();
}

// Bytes as a mesh: how it is imported, then vertices on a coarse lattice, where many meet, lie in
// one line or nearly so, then triangles.
FuzzOutcome ImportMesh(std::string_view bytes) {
  constexpr size_t kHead = 2;
  if (bytes.size() < kHead) return FuzzOutcome::kUnparsable;
  const auto at = [&](size_t k) { return static_cast<unsigned char>(bytes[k]); };
  const size_t vertices = 1 + at(1) % 128;
  if (bytes.size() < kHead + 3 * vertices + 3) return FuzzOutcome::kUnparsable;
  std::vector<double> positions;
  for (size_t k = 0; k < 3 * vertices; ++k) {
    const auto step = static_cast<signed char>(bytes[kHead + k]);
    // The last bit is a step so small that vertices are welded, or edges collapse.
    positions.push_back(0.05 * (step >> 1) + (step & 1) * ((at(0) & 4) != 0 ? 1e-7 : 1e-3));
  }
  std::vector<uint32_t> corners;
  for (size_t k = kHead + 3 * vertices; k + 3 <= bytes.size(); k += 3) {
    for (size_t c = 0; c < 3; ++c) corners.push_back(static_cast<uint32_t>(at(k + c) % vertices));
  }
  v1::CreateClothsRequest request;
  request.set_session("sessions/none");
  v1::ClothSpec& spec = *request.mutable_spec();
  *spec.mutable_mesh()->mutable_positions_m() =
      Packed<double>(v1::PackedArray::FLOAT64, 3, positions);
  *spec.mutable_mesh()->mutable_triangles() = Packed<uint32_t>(v1::PackedArray::UINT32, 3, corners);
  spec.mutable_mesh_import()->set_as_drawn((at(0) & 1) != 0);
  if ((at(0) & 2) != 0) spec.mutable_material()->set_bending_rigidity_n_m(1e-5);
  if ((at(0) & 8) != 0) spec.mutable_material()->set_bending_stiffness_n_per_m(1);
  if ((at(0) & 16) != 0) spec.mutable_self_collision();
  if ((at(0) & 32) != 0) spec.add_pins()->set_particle(0);
  if ((at(0) & 64) != 0) spec.mutable_material()->set_shear_modulus_n_per_m(40);
  const Status status = CheckCreation(request);
  if (status.ok()) return FuzzOutcome::kAccepted;
  CheckRefusal(status);
  return FuzzOutcome::kRefused;
}

// A sheet of 5 x 5 vertices with a few defects.
std::vector<std::string> MeshSeeds() {
  std::vector<std::string> seeds;
  for (const int head : {0, 1, 2, 7, 8, 18, 34}) {
    std::string bytes{static_cast<char>(head), 24};
    for (int k = 0; k < 25; ++k) {
      for (const int x : {8 * (k % 5), k == 12 ? 1 : 0, 8 * (k / 5)}) {
        bytes += static_cast<char>(x);
      }
    }
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        const int a = 5 * row + column;
        for (const int corner : {a, a + 5, a + 1, a + 1, a + 5, a + 6}) {
          bytes += static_cast<char>(corner);
        }
      }
    }
    seeds.push_back(bytes);
  }
  return seeds;
}

Status CheckStepRequest(const v1::StepRequest& request) {
  constexpr uint32_t kMaxSteps = 1000;
  const auto checked = api::CheckStep(request, kMaxSteps);
  if (!checked.ok()) return checked.status();
  DRAPE_CHECK(checked->steps.has_value() != checked->until_step.has_value(), "extent");
  for (const ControlRow<PinControl>& row : checked->controls.pins) {
    DRAPE_CHECK(row.control.target_m.allFinite() && row.control.over_s >= 0, "pin");
  }
  for (const RigidTransform& transform : checked->resets.starts.transforms) {
    DRAPE_CHECK(IsUnit(transform), "rotation");
  }
  for (const ControlRow<GripControl>& row : checked->controls.grips) {
    DRAPE_CHECK(row.control.place_m.allFinite() && row.control.over_s >= 0, "grip");
    DRAPE_CHECK(row.control.action != GripAction::kGrabNearest || row.control.radius_m > 0,
                "radius");
  }
  const std::vector<uint32_t>& particles = checked->view.fields.particles;
  DRAPE_CHECK(std::ranges::adjacent_find(particles, std::greater_equal<>()) == particles.end(),
              "ascending");
  return Status::Ok();
}

v1::UpdateClothsRequest GoodUpdate() {
  v1::UpdateClothsRequest update;
  update.add_cloth_ids(1);
  *update.add_overrides() = GoodStep().resets().overrides(0);
  *update.mutable_spec() = GoodCreation().spec();
  for (const char* path :
       {"environment.gravity_m_per_s2", "environment.colliders", "pins", "settings",
        "material.friction_static", "environment.wind_m_per_s", "material.air_drag",
        "material.air_lift", "self_collision", "material.bending_rigidity_n_m"}) {
    update.mutable_update_mask()->add_paths(path);
  }
  return update;
}

v1::UpdateClothsRequest GoodChainUpdate() {
  v1::UpdateClothsRequest update;
  update.add_cloth_ids(1);
  *update.mutable_spec()->mutable_particles() = ShortChain();
  for (const char* path : {"particles.distance_constraints", "particles.springs",
                           "particles.point_joints", "material.stretch_compliance_m_per_n"}) {
    update.mutable_update_mask()->add_paths(path);
  }
  return update;
}

v1::ResetClothsRequest GoodReset() {
  v1::ResetClothsRequest reset;
  reset.set_session("sessions/none");
  reset.add_cloth_ids(1);
  Set(reset.mutable_transforms(), {0, 1, 0, 0, 0, 2, 0});
  *reset.add_overrides() = GoodStep().resets().overrides(0);
  return reset;
}

Status CheckResetRequest(const v1::ResetClothsRequest& request) {
  const auto checked = api::CheckReset(request);
  if (!checked.ok()) return checked.status();
  for (const RigidTransform& transform : checked->starts.transforms) {
    DRAPE_CHECK(IsUnit(transform), "rotation");
  }
  return Status::Ok();
}

// Every accepted picture can be drawn: numbers are finite, directions have length 1.
Status CheckPicture(const v1::RenderRequest& request) {
  const auto spec = api::CheckRender(request);
  if (!spec.ok()) return spec.status();
  DRAPE_CHECK(spec->width_px >= 16 && spec->width_px <= 4096, "width");
  DRAPE_CHECK(spec->height_px >= 16 && spec->height_px <= 4096, "height");
  DRAPE_CHECK(std::abs(spec->view_direction.norm() - 1) < 0.01, "direction");
  if (spec->camera) {
    const render::Camera& camera = *spec->camera;
    DRAPE_CHECK(std::abs(camera.up.norm() - 1) < 1e-12, "up");
    const Eigen::Vector3d ahead = (camera.target_m - camera.eye_m).normalized();
    DRAPE_CHECK(camera.up.cross(ahead).norm() >= 0.9e-3, "up is ahead");
  }
  if (spec->range) {
    DRAPE_CHECK(static_cast<float>(spec->range->low) < static_cast<float>(spec->range->high),
                "range");
  }
  return api::CheckTiles(*spec, 9);
}

std::vector<v1::RenderRequest> Pictures() {
  v1::RenderRequest fitted = GoodPicture();
  fitted.clear_camera();
  Set(fitted.mutable_fit()->mutable_view_direction(), {1, -1, 0.5});
  Set(fitted.mutable_fit()->mutable_include_m(), {-1, -1, -1, 1, 2, 3});
  return {GoodPicture(), fitted};
}

// A cloth of so many particles in a row, far from the origin of the world.
std::shared_ptr<ClothRecord> Row(uint32_t slot, uint32_t particles) {
  ModelDescription description;
  ParticleTopology row;
  for (uint32_t k = 0; k < particles; ++k) {
    row.positions_m.emplace_back(0.1 * k, 0, 0);
    row.masses_kg.push_back(1);
    if (k > 0) row.distance_constraints.push_back({k - 1, k, 0.1, 0});
  }
  description.topology = std::move(row);
  auto described = std::make_shared<ClothDescription>();
  described->model = SceneModel::Build(description).value();
  const Placement placement{{1000, -20, 0.25}, {0.5, 0, 0}};
  auto record = std::make_shared<ClothRecord>(placement, RigidTransform(), described);
  record->id = ClothId{slot, 0};
  return record;
}

const ClothList& Rows() {
  static const ClothList cloths{Row(3, 9), Row(5, 4), Row(8, 12)};
  return cloths;
}

// An accepted view of states is sent: every chunk within its limit, every row once.
Status CheckViewAndSend(const v1::StateView& message) {
  Violations violations;
  const api::ViewSpec view = api::CheckView(FieldPath("view"), message, violations);
  DRAPE_RETURN_IF_ERROR(violations.ToStatus());
  DRAPE_RETURN_IF_ERROR(api::CheckViewFits(FieldPath("view"), view, Rows()));
  const StateFields read = view.FieldsRead();
  std::vector<api::ChunkCloth> cloths = api::ChunkClothsOf(Rows(), view);
  ClothStates states;
  size_t rows = 0, sent = 0;
  for (const api::ChunkCloth& cloth : cloths) {
    rows += cloth.rows_read;
    sent += cloth.row_count;
    states.cloths.push_back({.completed_steps = 3, .time_s = 0.25, .fault = FaultReason::kNone});
  }
  std::vector<float> column;
  for (size_t k = 0; k < 3 * rows; ++k) {
    column.push_back(k % 7 == 0 ? 9e4f : 0.01f * static_cast<float>(k));
  }
  if (read.positions) states.columns.positions_m = column;
  if (read.velocities) states.columns.velocities_m_per_s = column;
  constexpr uint64_t kChunkBytes = 200;
  api::StateChunker chunker(std::move(cloths), std::move(states), kChunkBytes, view);
  size_t arrived = 0;
  while (chunker.has_next()) {
    grpc::ByteBuffer bytes = api::ToByteBuffer(chunker.Next());
    v1::StateChunk chunk;
    DRAPE_CHECK(grpc::SerializationTraits<v1::StateChunk>::Deserialize(&bytes, &chunk).ok(),
                "no StateChunk");
    for (const uint32_t count : chunk.particle_counts()) arrived += count;
    DRAPE_CHECK(chunk.is_last() != chunker.has_next(), "the last one");
    DRAPE_CHECK(
        chunk.positions_m().data().size() + chunk.velocities_m_per_s().data().size() <= kChunkBytes,
        "too large");
  }
  DRAPE_CHECK(arrived == sent || !view.fields.any(), "rows got lost");
  return Status::Ok();
}

std::vector<v1::StateView> Views() {
  std::vector<v1::StateView> views(4);
  views[1].set_positions(true);
  views[1].set_velocities(true);
  views[1].set_encoding(v1::StateView::FIXED16);
  views[2].set_velocities(true);
  views[2].set_encoding(v1::StateView::FLOAT16);
  for (const uint32_t p : {0, 2, 3}) views[2].add_particles(p);
  for (const auto reduction :
       {v1::StateView::COVERAGE, v1::StateView::CENTROID, v1::StateView::BOX}) {
    views[3].add_reductions(reduction);
  }
  views[3].set_coverage_radius_m(0.05);
  return views;
}

v1::WriteStatesRequest GoodWriting() {
  v1::WriteStatesRequest request;
  request.set_session("sessions/none");
  std::vector<float> numbers;
  for (int k = 0; k < 3 * 25; ++k) numbers.push_back(0.01f * static_cast<float>(k));
  for (const uint64_t id : {3, 5, 8}) request.add_cloth_ids(id);
  *request.mutable_positions_m() = Packed<float>(v1::PackedArray::FLOAT32, 3, numbers);
  *request.mutable_velocities_m_per_s() = Packed<float>(v1::PackedArray::FLOAT32, 3, numbers);
  request.set_frame(v1::WriteStatesRequest::ENVIRONMENT);
  return request;
}

Status CheckWriting(const v1::WriteStatesRequest& request) {
  DRAPE_RETURN_IF_ERROR(api::CheckWriteStates(request));
  const auto states = api::ToStates(request, Rows());
  if (!states.ok()) return states.status();
  DRAPE_CHECK(states->size() == Rows().size(), "a state per cloth");
  for (const ParticleState& state : *states) {
    for (const Eigen::Vector3d& p : state.positions_m) DRAPE_CHECK(p.allFinite(), "position");
    for (const Eigen::Vector3d& v : state.velocities_m_per_s) DRAPE_CHECK(v.allFinite(), "speed");
  }
  return Status::Ok();
}

v1::StreamStatesRequest::Subscribe GoodSubscription() {
  v1::StreamStatesRequest::Subscribe request;
  request.set_session("sessions/none");
  request.add_cloth_ids(1);
  request.mutable_view()->set_velocities(true);
  request.set_max_hz(50);
  request.set_every_n_steps(2);
  request.set_initial_credit(3);
  return request;
}

v1::StreamStatesRequest::Subscribe EveryFrame() {
  v1::StreamStatesRequest::Subscribe request;
  request.set_session("sessions/none");
  request.set_all_cloths(true);
  request.set_delivery(v1::StreamStatesRequest::EVERY_FRAME);
  request.set_max_queued_frames(100);
  request.set_max_queued_bytes(1 << 20);
  return request;
}

Status CheckSubscription(const v1::StreamStatesRequest::Subscribe& request) {
  const auto checked = api::CheckSubscribe(request);
  if (!checked.ok()) return checked.status();
  DRAPE_CHECK(checked->every_n_steps >= 1 && checked->max_hz >= 0, "rate");
  if (checked->queue) {
    DRAPE_CHECK(checked->max_hz == 0 && checked->initial_credit == 0, "leaves frames out");
    DRAPE_CHECK(checked->queue->max_frames >= 2 && checked->queue->max_frames <= 65536, "frames");
    DRAPE_CHECK(checked->queue->max_bytes <= uint64_t{1} << 28, "bytes");
  }
  return Status::Ok();
}

std::vector<v1::RunRequest::Start> Runs() {
  std::vector<v1::RunRequest::Start> runs(2);
  for (v1::RunRequest::Start& run : runs) run.set_session("sessions/none");
  runs[0].set_all_cloths(true);
  runs[0].set_steps_hz(60);
  runs[0].set_max_behind_s(0.5);
  runs[0].set_report_interval_s(0.1);
  runs[1].add_cloth_ids(1);
  runs[1].set_unpaced(true);
  runs[1].set_max_steps(100);
  runs[1].set_expected_step(3);
  return runs;
}

// Every accepted run has a pace: however often it is asked, each step is due once or dropped.
Status CheckRunAndPace(const v1::RunRequest::Start& request) {
  const auto checked = api::CheckRun(request);
  if (!checked.ok()) return checked.status();
  DRAPE_CHECK(checked->interval_s >= 0 && checked->interval_s <= 1000, "interval");
  DRAPE_CHECK(checked->max_behind_s >= 0.02 && checked->max_behind_s <= 60, "lateness");
  DRAPE_CHECK(checked->report_interval_s >= 0.01 && checked->report_interval_s <= 3600, "reports");
  DRAPE_CHECK(checked->max_steps >= 1, "no step");
  if (checked->interval_s == 0) return Status::Ok();
  api::RunPace pace(1e6 * checked->interval_s, static_cast<int64_t>(1e6 * checked->max_behind_s),
                    0);
  uint64_t begun = 0, due = 0;
  for (int64_t now_us = 0; now_us < 200'000'000; now_us += 7'654'321) {
    for (int k = 0; k < 3 && pace.IsDue(now_us); ++k, ++begun) pace.Begin();
    const uint64_t total = begun + pace.dropped() + pace.Waiting(now_us);
    DRAPE_CHECK(total >= due, "steps got lost");
    due = total;
  }
  return Status::Ok();
}

}  // namespace

std::vector<FuzzTarget> RequestTargets() {
  std::vector<FuzzTarget> targets;
  targets.push_back(Target<v1::CreateClothsRequest>("create_cloths", Creations(), CheckCreation));
  targets.push_back(Target<v1::UpdateClothsRequest>(
      "update_cloths", {GoodUpdate(), GoodChainUpdate()},
      [](const auto& request) { return api::CheckUpdateCloths(request, SmallLimits()).status(); }));
  targets.push_back(Target<v1::StepRequest>("step", {GoodStep()}, CheckStepRequest));
  targets.push_back(Target<v1::ResetClothsRequest>("reset", {GoodReset()}, CheckResetRequest));
  targets.push_back(Target<v1::RenderRequest>("render", Pictures(), CheckPicture));
  targets.push_back(Target<v1::StateView>("view", Views(), CheckViewAndSend));
  targets.push_back(Target<v1::WriteStatesRequest>("write_states", {GoodWriting()}, CheckWriting));
  targets.push_back(Target<v1::StreamStatesRequest::Subscribe>(
      "subscribe", {GoodSubscription(), EveryFrame()}, CheckSubscription));
  targets.push_back(Target<v1::RunRequest::Start>("run", Runs(), CheckRunAndPace));
  targets.push_back({"mesh", ImportMesh, MeshSeeds});
  return targets;
}

}  // namespace drape::test
