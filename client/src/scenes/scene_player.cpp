#include "drape/scene_player.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "client/src/errors.h"
#include "drape/scene_file.h"

namespace drape {
inline namespace client {

namespace {

// The targets of one kind that take effect now, by cloth and element. If two targets name the same
// element, the later one in the file counts.
template <class Target>
using Targets = std::map<std::pair<ClothId, uint32_t>, const Target*>;

// The columns that only one table of a StepRequest has.
void AddColumns(uint32_t particle, const v1::PinTarget& target, v1::PinControls* table) {
  table->add_particles(particle);
  table->mutable_targets_m()->MergeFrom(target.target_m());
}

void AddColumns(uint32_t collider, const v1::ColliderTarget& target, v1::ColliderControls* table) {
  table->add_colliders(collider);
  table->mutable_positions_m()->MergeFrom(target.position_m());
  if (target.rotation_xyzw().empty()) {
    for (const double none : {0.0, 0.0, 0.0, 1.0}) table->add_rotations_xyzw(none);
  } else {
    table->mutable_rotations_xyzw()->MergeFrom(target.rotation_xyzw());
  }
}

void AddColumns(uint32_t constraint, const v1::RestLengthTarget& target,
                v1::RestLengthControls* table) {
  table->add_constraints(constraint);
  table->add_lengths_m(target.rest_length_m());
}

void AddColumns(uint32_t /*element*/, const v1::RestLengthScale& target,
                v1::RestLengthScales* table) {
  table->add_scales(target.scale());
}

template <class Target, class Table>
void AddRows(const Targets<Target>& targets, Table* (v1::StepRequest::*mutable_table)(),
             v1::StepRequest* request) {
  for (const auto& [element, target] : targets) {
    Table* table = (request->*mutable_table)();
    table->add_cloth_ids(element.first);
    AddColumns(element.second, *target, table);
    table->add_over_s(target->over_s());
  }
}

void AddGrip(ClothId cloth, const v1::GripTarget& target, v1::GripControls* table) {
  table->add_cloth_ids(cloth);
  table->add_slots(target.slot());
  table->add_actions(target.action());
  table->add_particles(target.particle());
  table->add_radii_m(target.radius_m());
  for (int axis = 0; axis < 3; ++axis) {
    table->add_targets_m(target.target_m().empty() ? 0 : target.target_m(axis));
  }
  table->add_over_s(target.over_s());
  table->add_largest_forces_n(target.largest_force_n());
}

}  // namespace

ScenePlayer::ScenePlayer(Session& session, const v1::Scene& scene,
                         const v1::ServerInfo::Limits& limits)
    : session_(session), scene_(scene), limits_(limits), step_count_(StepCount(scene)) {
  try {
    for (int entry = 0; entry < scene_.cloths_size(); ++entry) CreateEntry(entry);
  } catch (const Error&) {
    DeleteCreated();
    throw;
  }
}

void ScenePlayer::DeleteCreated() {
  if (cloths_.empty()) return;  // a request without ids may mean all cloths
  std::vector<ClothId> ids;
  for (const PlayedCloth& cloth : cloths_) ids.push_back(cloth.id);
  try {
    session_.DeleteCloths(ids);
  } catch (const Error&) {  // the error of the creation counts
  }
}

void ScenePlayer::CreateEntry(int entry) {
  const v1::SceneCloth& cloth = scene_.cloths(entry);
  const uint32_t count = cloth.has_count() ? cloth.count() : 1;
  const std::string path = "cloths[" + std::to_string(entry) + "]";
  if (limits_.max_cloths_per_session() > 0 && count > limits_.max_cloths_per_session()) {
    throw BadField(path + ".count", std::to_string(count) + " is above the server's limit of " +
                                        std::to_string(limits_.max_cloths_per_session()) +
                                        " cloths per session");
  }
  v1::CreateClothsRequest request;
  *request.mutable_spec() = cloth.spec();
  request.set_count(count);
  request.set_world(cloth.world());
  for (uint32_t copy = 0; copy < count; ++copy) {
    request.add_environment_origins_m(copy * cloth.spacing_m());
    request.add_environment_origins_m(0);
    request.add_environment_origins_m(0);
  }
  try {
    const v1::CreateClothsResponse response = session_.CreateCloths(std::move(request));
    for (const ClothId id : response.cloth_ids()) {
      cloths_.push_back({id, entry, response.shape()});
    }
  } catch (const Error& error) {
    throw Below(path, error);
  }
}

std::vector<ClothId> ScenePlayer::ControlledIds(const v1::SceneControl& control) const {
  std::vector<ClothId> ids;
  if (control.cloths().empty()) {
    for (const PlayedCloth& cloth : cloths_) ids.push_back(cloth.id);
  }
  for (const uint32_t index : control.cloths()) ids.push_back(cloths_.at(index).id);
  return ids;
}

void ScenePlayer::SetEnvironment(const v1::SceneControl& control) {
  std::vector<std::string> paths;
  v1::ClothSpec spec;
  if (!control.gravity_m_per_s2().empty()) {
    paths.push_back("environment.gravity_m_per_s2");
    *spec.mutable_environment()->mutable_gravity_m_per_s2() = control.gravity_m_per_s2();
  }
  if (!control.wind_m_per_s().empty()) {
    paths.push_back("environment.wind_m_per_s");
    *spec.mutable_environment()->mutable_wind_m_per_s() = control.wind_m_per_s();
  }
  if (!paths.empty()) session_.UpdateCloths(ControlledIds(control), spec, paths);
}

void ScenePlayer::ApplyControls(v1::StepRequest* request) {
  Targets<v1::PinTarget> pins;
  Targets<v1::ColliderTarget> colliders;
  Targets<v1::RestLengthTarget> lengths;
  Targets<v1::RestLengthScale> scales;
  for (const v1::SceneControl& control : scene_.controls()) {
    if (FirstStepAtOrAfter(control.time_s(), scene_.time_step_s()) != step_) continue;
    SetEnvironment(control);
    for (const ClothId id : ControlledIds(control)) {
      for (const auto& target : control.pin_targets()) pins[{id, target.particle()}] = &target;
      for (const auto& target : control.collider_targets()) {
        colliders[{id, target.collider()}] = &target;
      }
      for (const auto& target : control.rest_lengths()) {
        lengths[{id, target.constraint()}] = &target;
      }
      for (const auto& target : control.grips()) {
        AddGrip(id, target, request->mutable_grip_controls());
      }
      if (control.has_rest_length_scale()) scales[{id, 0}] = &control.rest_length_scale();
    }
  }
  AddRows(pins, &v1::StepRequest::mutable_pin_controls, request);
  AddRows(colliders, &v1::StepRequest::mutable_collider_controls, request);
  AddRows(lengths, &v1::StepRequest::mutable_rest_length_controls, request);
  AddRows(scales, &v1::StepRequest::mutable_rest_length_scales, request);
}

uint64_t ScenePlayer::NextControlStep() const {
  uint64_t next = step_count_;
  for (const v1::SceneControl& control : scene_.controls()) {
    const uint64_t start = FirstStepAtOrAfter(control.time_s(), scene_.time_step_s());
    if (start > step_) next = std::min(next, start);
  }
  return next;
}

// A request of `steps` steps took `wait_s`.
void ScenePlayer::AdaptRequests(uint64_t steps, double wait_s) {
  constexpr double kRequestS = 0.5;
  constexpr double kMostGrowth = 8;  // a short request predicts little about a long one
  const double growth = std::min(kMostGrowth, kRequestS / std::max(wait_s, 1e-9));
  const double wanted = std::max(1.0, static_cast<double>(steps) * growth);
  // A request cut short, by the end or a control, is no reason for shorter requests.
  if (growth < 1 || wanted > static_cast<double>(steps_per_request_)) {
    steps_per_request_ = static_cast<uint64_t>(std::min(wanted, 1e9));
  }
}

AdvanceResult ScenePlayer::Advance(uint64_t steps, bool has_reports,
                                   const std::function<bool()>& should_stop, bool has_impulses,
                                   bool has_contacts) {
  uint64_t end = step_ + std::min(steps, step_count_ - step_);
  uint64_t max_steps = limits_.max_steps_per_request();
  if (max_steps == 0) max_steps = std::numeric_limits<uint32_t>::max();
  AdvanceResult result;
  result.has_impulses = has_impulses;
  if (step_ == end) return result;
  while (step_ < end) {
    v1::StepRequest request;
    request.set_all_cloths(true);
    ApplyControls(&request);
    const uint64_t until =
        std::min({end, NextControlStep(), step_ + max_steps, step_ + steps_per_request_});
    request.set_steps(static_cast<uint32_t>(until - step_));
    request.set_expected_step(step_);
    request.set_report(has_reports && until == end);
    request.set_impulses(has_impulses && until == end);
    request.set_contact_impulses(has_contacts && until == end);

    const auto start = std::chrono::steady_clock::now();
    v1::StepResponse response = session_.Step(std::move(request));
    const std::chrono::duration<double> wait = std::chrono::steady_clock::now() - start;
    AdaptRequests(until - step_, wait.count());
    result.wait_s += wait.count();
    result.device_us += response.timing().device_us();
    step_ = until;
    result.reports = {response.reports().begin(), response.reports().end()};
    result.collider_impulses = std::move(*response.mutable_collider_impulses());
    result.pin_impulses = std::move(*response.mutable_pin_impulses());
    if (should_stop && should_stop()) end = std::min(end, step_ + 1);
  }
  if (has_reports && result.reports.size() != cloths_.size()) {
    throw LocalError(ErrorCode::kInternal, "MALFORMED_ANSWER",
                     "the server sent " + std::to_string(result.reports.size()) + " reports for " +
                         std::to_string(cloths_.size()) + " cloths");
  }
  return result;
}

}  // namespace client
}  // namespace drape
