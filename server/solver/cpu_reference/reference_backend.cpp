#include "server/solver/cpu_reference/reference_backend.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <unordered_map>
#include <utility>

#include "server/core/check.h"
#include "server/solver/cpu_reference/reference_step.h"
#include "server/solver/update_check.h"

namespace drape {

namespace {

using Eigen::Vector3d;

std::vector<Vector3d> PinPositions(const SceneModel& model, const ParticleState& state) {
  std::vector<Vector3d> positions;
  for (const uint32_t pin : model.pins()) positions.push_back(state.positions_m[pin]);
  return positions;
}

class ReferenceBackend final : public Backend {
 public:
  BackendDescription Describe() const override {
    return {.name = "reference",
            .device = "1 core, double precision",
            .scalar = ScalarType::kFloat64,
            .is_hardware_gpu = false,
            .has_self_collision = true,
            .has_impulses = true,
            .plan_of = [](const SceneModel&) { return "scalar"; }};
  }

  Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                             const ClothParameters& parameters,
                             const ParticleState& state) override {
    DRAPE_RETURN_IF_ERROR(CheckStateFits(*model, parameters, state));
    std::vector<Vector3d> pin_targets = PinPositions(*model, state);
    // Handles are never reused: the slot counts up and wraps into the generation.
    if (++next_handle_.slot == 0) ++next_handle_.generation;
    cloths_.emplace(next_handle_, ReferenceCloth{.model = std::move(model),
                                                 .parameters = parameters,
                                                 .state = state,
                                                 .pin_targets_m = std::move(pin_targets)});
    SetContactSurface(cloths_.at(next_handle_));
    return next_handle_;
  }

  void Destroy(ClothHandle handle) override {
    AbandonStep(handle);
    DRAPE_CHECK(cloths_.erase(handle) == 1, "no such cloth");
  }

  BatchReport Step(std::span<const StepItem> items) override {
    const auto start = Clock::now();
    BatchReport batch;
    for (const StepItem& item : items) {
      AbandonStep(item.cloth);
      ReferenceCloth& cloth = Find(item.cloth);
      SetTargets(cloth, item);
      batch.reports.push_back(
          StepReferenceCloth(cloth, AskedBy(item), IterationsOf(item, cloth.parameters.settings)));
    }
    batch.device_us = UsSince(start);
    return batch;
  }

  std::optional<BatchReport> StepPiece(const StepItem& item, const Pause& pause) override {
    const auto start = Clock::now();
    std::unique_ptr<ReferenceStep>& step = steps_under_way_[item.cloth];
    if (step == nullptr) {
      ReferenceCloth& cloth = Find(item.cloth);
      SetTargets(cloth, item);
      step = std::make_unique<ReferenceStep>(cloth, AskedBy(item),
                                             IterationsOf(item, cloth.parameters.settings));
    }
    const std::optional<StepReport> report = step->Continue(pause);
    if (!report) return std::nullopt;
    steps_under_way_.erase(item.cloth);
    BatchReport batch;
    batch.reports.push_back(*report);
    batch.device_us = UsSince(start);
    return batch;
  }

  void AbandonStep(ClothHandle handle) override {
    if (steps_under_way_.erase(handle) == 0) return;
    ReferenceCloth& cloth = Find(handle);
    cloth.rest_length_targets_m = cloth.rest_lengths_m;
  }

  StateColumns Read(const ReadRequest& request) override {
    std::vector<double> positions;
    std::vector<double> velocities;
    for (const ClothHandle handle : request.cloths) {
      const ParticleState& state = Find(handle).state;
      if (request.positions) Append(state.positions_m, request.particles, positions);
      if (request.velocities) Append(state.velocities_m_per_s, request.particles, velocities);
    }
    return {.positions_m = std::move(positions), .velocities_m_per_s = std::move(velocities)};
  }

  bool MayCrossItself(ClothHandle handle) override { return Find(handle).may_cross_itself; }

  Status Write(ClothHandle handle, const ClothUpdate& update) override {
    AbandonStep(handle);
    ReferenceCloth& cloth = Find(handle);
    DRAPE_RETURN_IF_ERROR(CheckUpdateFits(*cloth.model, cloth.parameters, update));
    if (update.state) {
      cloth.state = *update.state;
      cloth.fault = update.fault;
    }
    if (update.model) ReplaceModel(cloth, update.model);
    if (update.rest_lengths_m) {
      cloth.rest_lengths_m = cloth.rest_length_targets_m = *update.rest_lengths_m;
    }
    if (update.parameters) cloth.parameters = *update.parameters;
    if (update.collider_motions) {
      cloth.parameters.collider_motions = *update.collider_motions;
    }
    SetContactSurface(cloth);
    cloth.may_cross_itself = update.may_cross_itself;
    if (update.pin_targets_m) cloth.pin_targets_m = *update.pin_targets_m;
    return Status::Ok();
  }

 private:
  using Clock = std::chrono::steady_clock;

  static int64_t UsSince(Clock::time_point start) {
    return std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - start).count();
  }

  static AskedOfStep AskedBy(const StepItem& item) {
    return {.measure = item.measure, .impulses = item.impulses};
  }

  // Sets the targets of pins, lengths and colliders in a step.
  static void SetTargets(ReferenceCloth& cloth, const StepItem& item) {
    if (cloth.fault != FaultReason::kNone) return;
    if (!item.pin_targets_m.empty()) {
      DRAPE_CHECK(item.pin_targets_m.size() == cloth.model->pin_count(), "one target per pin");
      cloth.pin_targets_m.assign(item.pin_targets_m.begin(), item.pin_targets_m.end());
    }
    SetLengthTargets(cloth, item.rest_lengths_m);
    DRAPE_CHECK(item.grips.size() <= cloth.parameters.max_grips, "no more grips than max_grips");
    cloth.grips.assign(item.grips.begin(), item.grips.end());
    if (!item.collider_motions.empty()) {
      cloth.parameters.collider_motions = CheckedMotions(cloth.parameters, item.collider_motions);
    }
  }

  void SetContactSurface(ReferenceCloth& cloth) {
    cloth.may_cross_itself = true;
    const bool touches_itself =
        cloth.parameters.self_collision && !cloth.model->triangles().empty();
    cloth.contact_surface = touches_itself ? surfaces_.Get(cloth.model) : nullptr;
  }

  // Those of `particles`; empty: all.
  static void Append(const std::vector<Vector3d>& vectors, std::span<const uint32_t> particles,
                     std::vector<double>& packed) {
    const auto append = [&](const Vector3d& v) {
      packed.insert(packed.end(), v.data(), v.data() + 3);
    };
    if (particles.empty()) std::for_each(vectors.begin(), vectors.end(), append);
    for (const uint32_t particle : particles) append(vectors[particle]);
  }

  static std::vector<RigidMotion> CheckedMotions(const ClothParameters& parameters,
                                                 std::span<const RigidMotion> motions) {
    DRAPE_CHECK(HasMovingColliders(parameters) && motions.size() == parameters.colliders.size(),
                "only a cloth with moving colliders has motions, one per collider");
    return {motions.begin(), motions.end()};
  }

  static void CheckLengths(const SceneModel& model, std::span<const double> rest_lengths_m) {
    DRAPE_CHECK(rest_lengths_m.empty() || rest_lengths_m.size() == model.constraint_count(),
                "one rest length per constraint");
  }

  // A step begins with the lengths at which the last one ended; without targets it keeps them.
  static void SetLengthTargets(ReferenceCloth& cloth, std::span<const double> rest_lengths_m) {
    cloth.rest_lengths_m = cloth.rest_length_targets_m;
    if (rest_lengths_m.empty()) return;
    CheckLengths(*cloth.model, rest_lengths_m);
    DRAPE_CHECK(cloth.has_own_lengths(), "only a cloth with rest lengths of its own is driven");
    cloth.rest_length_targets_m.assign(rest_lengths_m.begin(), rest_lengths_m.end());
  }

  // Pins that stay keep their targets; new ones start where they are.
  static void ReplaceModel(ReferenceCloth& cloth, std::shared_ptr<const SceneModel> model) {
    std::vector<Vector3d> targets = PinPositions(*model, cloth.state);
    const std::span<const uint32_t> old_pins = cloth.model->pins();
    for (uint32_t k = 0; k < model->pin_count(); ++k) {
      const auto old = std::lower_bound(old_pins.begin(), old_pins.end(), model->pins()[k]);
      if (old != old_pins.end() && *old == model->pins()[k]) {
        targets[k] = cloth.pin_targets_m[old - old_pins.begin()];
      }
    }
    cloth.pin_targets_m = std::move(targets);
    cloth.rest_lengths_m.clear();
    cloth.rest_length_targets_m.clear();
    cloth.model = std::move(model);
  }

  ReferenceCloth& Find(ClothHandle handle) {
    const auto entry = cloths_.find(handle);
    DRAPE_CHECK(entry != cloths_.end(), "no such cloth");
    return entry->second;
  }

  std::unordered_map<ClothHandle, ReferenceCloth> cloths_;
  std::unordered_map<ClothHandle, std::unique_ptr<ReferenceStep>> steps_under_way_;  // in pieces
  ContactSurfaceCache surfaces_;
  ClothHandle next_handle_{.slot = 0, .generation = 1};
};

}  // namespace

std::unique_ptr<Backend> CreateReferenceBackend() {
  return std::make_unique<ReferenceBackend>();
}

}  // namespace drape
