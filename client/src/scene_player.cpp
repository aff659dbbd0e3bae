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
  if (cloths_.empty()) return;  // naming none may mean all
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
  // If two controls move the same thing from the same step on, the later one in the file counts.
  std::map<std::pair<ClothId, uint32_t>, const v1::PinTarget*> targets;
  std::map<std::pair<ClothId, uint32_t>, const v1::RestLengthTarget*> lengths;
  std::map<ClothId, const v1::RestLengthScale*> scales;
  std::map<std::pair<ClothId, uint32_t>, const v1::ColliderTarget*> colliders;
  for (const v1::SceneControl& control : scene_.controls()) {
    if (FirstStepAtOrAfter(control.time_s(), scene_.time_step_s()) != step_) continue;
    SetEnvironment(control);
    for (const ClothId id : ControlledIds(control)) {
      for (const auto& target : control.pin_targets()) targets[{id, target.particle()}] = &target;
      for (const auto& target : control.rest_lengths()) {
        lengths[{id, target.constraint()}] = &target;
      }
      for (const auto& target : control.collider_targets()) {
        colliders[{id, target.collider()}] = &target;
      }
      if (control.has_rest_length_scale()) scales[id] = &control.rest_length_scale();
    }
  }
  for (const auto& [pin, target] : targets) {
    v1::PinControls* controls = request->mutable_pin_controls();
    controls->add_cloth_ids(pin.first);
    controls->add_particles(pin.second);
    controls->mutable_targets_m()->MergeFrom(target->target_m());
    controls->add_over_s(target->over_s());
  }
  for (const auto& [collider, target] : colliders) {
    v1::ColliderControls* controls = request->mutable_collider_controls();
    controls->add_cloth_ids(collider.first);
    controls->add_colliders(collider.second);
    controls->mutable_positions_m()->MergeFrom(target->position_m());
    if (target->rotation_xyzw().empty()) {
      for (const double none : {0.0, 0.0, 0.0, 1.0}) controls->add_rotations_xyzw(none);
    } else {
      controls->mutable_rotations_xyzw()->MergeFrom(target->rotation_xyzw());
    }
    controls->add_over_s(target->over_s());
  }
  for (const auto& [constraint, target] : lengths) {
    v1::RestLengthControls* controls = request->mutable_rest_length_controls();
    controls->add_cloth_ids(constraint.first);
    controls->add_constraints(constraint.second);
    controls->add_lengths_m(target->rest_length_m());
    controls->add_over_s(target->over_s());
  }
  for (const auto& [id, scale] : scales) {
    v1::RestLengthScales* controls = request->mutable_rest_length_scales();
    controls->add_cloth_ids(id);
    controls->add_scales(scale->scale());
    controls->add_over_s(scale->over_s());
  }
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
                                   const std::function<bool()>& should_stop) {
  uint64_t end = step_ + std::min(steps, step_count_ - step_);
  uint64_t max_steps = limits_.max_steps_per_request();
  if (max_steps == 0) max_steps = std::numeric_limits<uint32_t>::max();
  AdvanceResult result;
  if (step_ == end) return result;
  while (step_ < end) {
    v1::StepRequest request;
    ApplyControls(&request);
    const uint64_t until =
        std::min({end, NextControlStep(), step_ + max_steps, step_ + steps_per_request_});
    request.set_steps(static_cast<uint32_t>(until - step_));
    request.set_expected_step(step_);
    request.set_report(has_reports && until == end);

    const auto start = std::chrono::steady_clock::now();
    v1::StepResponse response = session_.Step(std::move(request));
    const std::chrono::duration<double> wait = std::chrono::steady_clock::now() - start;
    AdaptRequests(until - step_, wait.count());
    result.wait_s += wait.count();
    result.device_us += response.timing().device_us();
    step_ = until;
    result.reports = {response.reports().begin(), response.reports().end()};
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
