#include "server/solver/cpu_reference/reference_backend.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <unordered_map>
#include <utility>

#include "server/core/check.h"
#include "server/solver/collider_contact.h"
#include "server/solver/cpu_reference/reference_step.h"
#include "server/solver/drop_when_due.h"
#include "server/solver/pausable_work.h"
#include "server/solver/self_contact/self_contacts.h"
#include "server/solver/surface_contact/surface_contacts.h"
#include "server/solver/update_check.h"

namespace drape {

namespace {

using Eigen::Vector3d;

std::vector<Vector3d> PinPositions(const SceneModel& model, const ParticleState& state) {
  std::vector<Vector3d> positions;
  for (const uint32_t pin : model.pins()) positions.push_back(state.positions_m[pin]);
  return positions;
}

// Of a StepContext, for each particle, about: 20 vectors.
constexpr uint64_t kScratchBytes = 480;
// The same for each particle and collider: StepContext::beta and rebounds.
constexpr uint64_t kContactBytes = sizeof(ContactImpulse) + sizeof(double);

class ReferenceBackend final : public Backend {
 public:
  BackendDescription Describe() const override {
    return {.name = "reference",
            .device = "1 core, double precision",
            .arithmetic = "double precision",
            .scalar = ScalarType::kFloat64,
            .is_hardware_gpu = false,
            .has_cheap_impulses = true,
            .plan_of = [](const SceneModel&, const ClothParameters&) { return "scalar"; }};
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
    return StepUntil(items, Pause::Never());
  }

  BatchReport StepUntil(std::span<const StepItem> items, const Pause& pause) override {
    const auto start = Clock::now();
    BatchReport batch;
    while (!items.empty()) {
      const std::span<const StepItem> together = items.first(WorldSize(items));
      items = items.subspan(together.size());
      const auto reports = StepTogether(together, pause);
      batch.reports.insert(batch.reports.end(), reports.begin(), reports.end());
    }
    batch.device_us = UsSince(start);
    return batch;
  }

  std::optional<BatchReport> StepPiece(std::span<const StepItem> items,
                                       const Pause& pause) override {
    const auto start = Clock::now();
    std::vector<ClothHandle> handles;
    for (const StepItem& item : items) handles.push_back(item.cloth);
    const auto under_way = steps_under_way_.find(handles[0]);
    if (under_way == steps_under_way_.end() || under_way->second->cloths != handles) {
      for (const ClothHandle handle : handles) AbandonStep(handle);
      const auto begun = std::make_shared<LongStep>(
          std::move(handles),
          [this, items](Interruption* interruption) { return MakeStep(items, interruption); });
      for (const ClothHandle handle : begun->cloths) steps_under_way_[handle] = begun;
    }
    const std::shared_ptr<LongStep> step = steps_under_way_.at(items[0].cloth);
    if (!step->Continue(pause)) return std::nullopt;
    for (const ClothHandle handle : step->cloths) steps_under_way_.erase(handle);
    BatchReport batch{.reports = *std::move(step->reports)};
    batch.device_us = UsSince(start);
    return batch;
  }

  uint64_t LongStepBytes(std::span<const ClothHandle> handles) override {
    size_t particles = 0, contacts = 0, on_edges = 0;
    for (const ClothHandle handle : handles) {
      const ReferenceCloth& cloth = Find(handle);
      const size_t pairs = cloth.model->particle_count() * cloth.parameters.colliders.size();
      particles += cloth.model->particle_count();
      contacts += pairs;
      if (cloth.surface_parts != nullptr) on_edges += pairs;
    }
    const bool may_touch = handles.size() > 1 || Find(handles[0]).contact_surface != nullptr;
    return kScratchBytes * particles + kContactBytes * contacts +
           surface_contact::MostBytes<self_contact::Vector3d>(on_edges) +
           (may_touch ? self_contact::MostBytes<self_contact::Vector3d>(particles) : 0);
  }

  void AbandonStep(ClothHandle handle) override {
    const auto found = steps_under_way_.find(handle);
    if (found == steps_under_way_.end()) return;
    const std::shared_ptr<LongStep> step = found->second;
    for (const ClothHandle each : step->cloths) {
      steps_under_way_.erase(each);
      DropTargets(Find(each));
    }
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

  // A step that is done in pieces.
  struct LongStep {
    using Make = std::function<std::unique_ptr<ReferenceStep>(Interruption*)>;

    // `make` is called in the first piece.
    LongStep(std::vector<ClothHandle> its_cloths, Make make_step)
        : cloths(std::move(its_cloths)), make(std::move(make_step)) {
      work = PausableWork::Begin([this](Interruption& interruption, const Pause& pause) {
        step = make(&interruption);
        while (!(reports = step->Continue(pause, &interruption))) interruption.Check();
      });
    }

    // Whether it is over.
    bool Continue(const Pause& pause) {
      if (work) return work->Continue(pause);
      if (!step) step = make(nullptr);
      reports = step->Continue(pause);
      return reports.has_value();
    }

    const std::vector<ClothHandle> cloths;
    const Make make;
    std::unique_ptr<ReferenceStep> step{};
    std::optional<std::vector<StepReport>> reports{};
    std::unique_ptr<PausableWork> work{};  // null: there is no thread for it, and no stage stops
  };

  // Lengths are what they were when a step began that is dropped.
  static void DropTargets(ReferenceCloth& cloth) {
    if (cloth.fault != FaultReason::kNone) return;  // of which none has begun
    cloth.rest_length_targets_m = cloth.rest_lengths_m;
  }

  // One cloth or one world.
  std::vector<StepReport> StepTogether(std::span<const StepItem> items, const Pause& pause) {
    const auto start = Clock::now();
    std::vector<StepReport> undone(items.size());
    for (StepReport& report : undone) report.is_undone = true;
    if (pause.IsDue()) return undone;
    for (const StepItem& item : items) AbandonStep(item.cloth);
    std::optional<std::vector<StepReport>> reports = StepOrDrop(items, pause);
    if (!reports) {
      for (const StepItem& item : items) DropTargets(Find(item.cloth));
      reports = std::move(undone);
    }
    for (StepReport& report : *reports) {
      report.thread_us = static_cast<double>(UsSince(start)) / static_cast<double>(items.size());
    }
    return *std::move(reports);
  }

  // None: it is dropped, since the pause is due.
  std::optional<std::vector<StepReport>> StepOrDrop(std::span<const StepItem> items,
                                                    const Pause& pause) {
    DropWhenDue interruption(pause);
    try {
      return MakeStep(items, &interruption)->Continue(pause, &interruption);
    } catch (const WorkStopped&) {
      return std::nullopt;
    }
  }

  // Of one cloth or one world, whose targets are set.
  std::unique_ptr<ReferenceStep> MakeStep(std::span<const StepItem> items,
                                          Interruption* interruption) {
    std::vector<SteppedReference> cloths;
    uint32_t most_sweeps = UINT32_MAX;
    for (const StepItem& item : items) {
      ReferenceCloth& cloth = Find(item.cloth);
      SetTargets(cloth, item);
      cloths.push_back({&cloth, AskedBy(item), item.world.origin_m - items[0].world.origin_m});
      most_sweeps = std::min(most_sweeps, IterationsOf(item, cloth.parameters.settings));
    }
    auto surface =
        items.size() > 1 ? SurfaceOf(cloths, interruption) : cloths[0].cloth->contact_surface;
    return std::make_unique<ReferenceStep>(std::move(cloths), std::move(surface), most_sweeps);
  }

  std::shared_ptr<const ContactSurface> SurfaceOf(std::span<const SteppedReference> cloths,
                                                  Interruption* interruption) {
    std::vector<SurfaceMember> members;
    for (const SteppedReference& stepped : cloths) {
      ReferenceCloth& cloth = *stepped.cloth;
      if (cloth.world_surface == nullptr) cloth.world_surface = surfaces_.Get(cloth.model);
      members.push_back({cloth.world_surface.get(), cloth.contact_surface != nullptr});
    }
    return std::make_shared<const ContactSurface>(members, interruption);
  }

  static AskedOfStep AskedBy(const StepItem& item) {
    return {.measure = item.measure,
            .impulses = item.impulses,
            .contact_impulses = item.contact_impulses,
            .energy = item.energy};
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
    cloth.world_surface = nullptr;
    const bool touches_itself =
        cloth.parameters.self_collision && !cloth.model->triangles().empty();
    cloth.contact_surface = touches_itself ? surfaces_.Get(cloth.model) : nullptr;
    const bool has_parts = HasSurfaceContacts(*cloth.model, cloth.parameters);
    cloth.surface_parts = has_parts ? parts_.Get(cloth.model) : nullptr;
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
  std::unordered_map<ClothHandle, std::shared_ptr<LongStep>> steps_under_way_;
  ContactSurfaceCache surfaces_;
  SurfacePartsCache parts_;
  ClothHandle next_handle_{.slot = 0, .generation = 1};
};

}  // namespace

std::unique_ptr<Backend> CreateReferenceBackend() {
  return std::make_unique<ReferenceBackend>();
}

}  // namespace drape
