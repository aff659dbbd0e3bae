#include "server/solver/backend_pair.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/core/check.h"
#include "server/solver/collider_contact.h"
#include "server/solver/device_backend.h"

namespace drape {
namespace {

// Marks the slots of the second backend in the handles of the pair; no backend has so many cloths.
constexpr uint32_t kSecondBit = uint32_t{1} << 31;

// The rows of a cloth in the column of its backend.
struct ClothRows {
  bool is_second = false;
  size_t count = 0;
};

// The rows of cloths of both, in the order of `rows`.
ScalarColumn Merged(const ScalarColumn& first, const ScalarColumn& second,
                    const std::vector<ClothRows>& rows) {
  return std::visit(
      [&](const auto& values) -> ScalarColumn {
        using Values = std::decay_t<decltype(values)>;
        const Values& others = std::get<Values>(second);
        Values merged;
        merged.reserve(values.size() + others.size());
        auto next = values.begin();
        auto next_other = others.begin();
        if (values.empty() && others.empty()) return merged;
        for (const ClothRows& its : rows) {
          auto& from = its.is_second ? next_other : next;
          const auto end = from + static_cast<ptrdiff_t>(3 * its.count);
          merged.insert(merged.end(), from, end);
          from = end;
        }
        return merged;
      },
      first);
}

// States of cloths of both.
class PendingReadOfBoth final : public PendingRead {
 public:
  PendingReadOfBoth(std::unique_ptr<PendingRead> first, std::unique_ptr<PendingRead> second,
                    std::vector<ClothRows> rows)
      : first_(std::move(first)), second_(std::move(second)), rows_(std::move(rows)) {}

  StateColumns Take() override {
    const StateColumns first = first_->Take(), second = second_->Take();
    return {Merged(first.positions_m, second.positions_m, rows_),
            Merged(first.velocities_m_per_s, second.velocities_m_per_s, rows_)};
  }

 private:
  const std::unique_ptr<PendingRead> first_, second_;
  const std::vector<ClothRows> rows_;
};

// What both did for one batch, one after the other, or at the same time.
BatchReport Merged(BatchReport first, BatchReport second, const std::vector<bool>& is_second,
                   bool at_the_same_time) {
  BatchReport batch;
  batch.dispatch_count = first.dispatch_count + second.dispatch_count;
  batch.upload_us = first.upload_us + second.upload_us;
  batch.device_us = at_the_same_time ? std::max(first.device_us, second.device_us)
                                     : first.device_us + second.device_us;
  batch.readback_us = first.readback_us + second.readback_us;
  size_t next = 0, next_other = 0;
  for (const bool is_other : is_second) {
    batch.reports.push_back(is_other ? std::move(second.reports[next_other++])
                                     : std::move(first.reports[next++]));
  }
  return batch;
}

class BackendPair final : public DeviceBackend {
 public:
  BackendPair(std::unique_ptr<Backend> first, std::unique_ptr<Backend> second)
      : first_(std::move(first)),
        second_(std::move(second)),
        first_description_(first_->Describe()),
        second_description_(second_->Describe()) {
    DRAPE_CHECK(first_description_.scalar == second_description_.scalar, "the same precision");
  }

  BackendDescription Describe() const override {
    BackendDescription description = first_description_;
    description.can_step = {};
    description.plan_of = [first = first_description_, second = second_description_](
                              const SceneModel& model, const ClothParameters& parameters) {
      return first.Steps(model, parameters) ? first.plan_of(model, parameters)
                                            : second.plan_of(model, parameters);
    };
    if (first_description_.prepare) {
      description.prepare = [first = first_description_](const SceneModel& model,
                                                         const ClothParameters& parameters) {
        if (first.Steps(model, parameters)) first.prepare(model, parameters);
      };
    }
    description.make_shared_parts = [first = first_description_, second = second_description_](
                                        const auto& model, const ClothParameters& parameters,
                                        Interruption* interruption) {
      const auto& made = (first.Steps(*model, parameters) ? first : second).make_shared_parts;
      return made ? made(model, parameters, interruption) : nullptr;
    };
    return description;
  }

  Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                             const ClothParameters& parameters,
                             const ParticleState& state) override {
    Cloth cloth{.model = model,
                .parameters = parameters,
                .is_second = !first_description_.Steps(*model, parameters),
                .may_go_over = MayGoOver(*model, parameters)};
    DRAPE_ASSIGN_OR_RETURN(cloth.inner,
                           Home(cloth.is_second).Create(std::move(model), parameters, state));
    ClothHandle handle = cloth.inner;
    if (cloth.is_second) handle.slot |= kSecondBit;
    elsewhere_ += IsElsewhere(handle, cloth);
    may_go_over_ += cloth.may_go_over;
    cloths_[handle] = std::move(cloth);
    return handle;
  }

  void Destroy(ClothHandle handle) override {
    const Cloth& cloth = cloths_.at(handle);
    Home(cloth.is_second).Destroy(cloth.inner);
    elsewhere_ -= IsElsewhere(handle, cloth);
    may_go_over_ -= cloth.may_go_over;
    cloths_.erase(handle);
  }

  BatchReport Step(std::span<const StepItem> items) override {
    return StepUntil(items, Pause::Never());
  }

  BatchReport StepUntil(std::span<const StepItem> items, const Pause& pause) override {
    return StepBoth(items, pause, [&](std::span<const StepItem> its, const auto& step_second) {
      BatchReport batch = its.empty() ? BatchReport{} : first_->StepUntil(its, pause);
      step_second();
      return batch;
    });
  }

  BatchReport StepAhead(std::span<const StepItem> items, const Pause& pause,
                        const std::function<void()>& meanwhile) override {
    if (!RunsAhead()) return StepUntil(items, pause);
    return StepBoth(items, pause, [&](std::span<const StepItem> its, const auto& step_second) {
      if (its.empty()) {
        meanwhile();
        step_second();
        return BatchReport{};
      }
      return first_->device()->StepAhead(its, pause, [&] {
        meanwhile();
        step_second();
      });
    });
  }

  std::optional<BatchReport> StepPiece(std::span<const StepItem> items,
                                       const Pause& pause) override {
    GoOver(items);
    std::vector<StepItem> inner(items.begin(), items.end());
    for (StepItem& item : inner) item.cloth = cloths_.at(item.cloth).inner;
    std::optional<BatchReport> batch =
        Home(cloths_.at(items[0].cloth).is_second).StepPiece(inner, pause);
    if (batch) NoteStep(items, batch->reports);
    return batch;
  }

  uint64_t LongStepBytes(std::span<const ClothHandle> handles) override {
    std::vector<ClothHandle> inner;
    for (const ClothHandle handle : handles) inner.push_back(cloths_.at(handle).inner);
    return Home(cloths_.at(handles[0]).is_second).LongStepBytes(inner);
  }

  void AbandonStep(ClothHandle handle) override {
    const Cloth& cloth = cloths_.at(handle);
    Home(cloth.is_second).AbandonStep(cloth.inner);
  }

  StateColumns Read(const ReadRequest& request) override { return BeginRead(request)->Take(); }

  bool MayCrossItself(ClothHandle handle) override {
    const Cloth& cloth = cloths_.at(handle);
    return Home(cloth.is_second).MayCrossItself(cloth.inner);
  }

  Status Write(ClothHandle handle, const ClothUpdate& update) override {
    Cloth& cloth = cloths_.at(handle);
    const std::shared_ptr<const SceneModel> model = update.model ? update.model : cloth.model;
    ClothParameters parameters = update.parameters.value_or(cloth.parameters);
    if (update.collider_motions) parameters.collider_motions = *update.collider_motions;
    const bool may_go_over = MayGoOver(*model, parameters);
    // One that has gone over is looked at when it is stepped.
    const bool stays = first_description_.Steps(*model, parameters)
                           ? !cloth.is_second || (cloth.may_go_over && may_go_over)
                           : cloth.is_second;
    if (stays) {
      DRAPE_RETURN_IF_ERROR(Home(cloth.is_second).Write(cloth.inner, update));
    } else {
      DRAPE_RETURN_IF_ERROR(Move(handle, model, parameters, update));
    }
    cloth.parameters = std::move(parameters);
    if (update.pin_targets_m) cloth.driven.pin_targets_m = *update.pin_targets_m;
    if (update.model) cloth.driven.rest_lengths_m.clear();
    if (update.rest_lengths_m) cloth.driven.rest_lengths_m = *update.rest_lengths_m;
    if (update.model || update.state) cloth.driven.held.clear();
    cloth.model = model;
    may_go_over_ += may_go_over;
    may_go_over_ -= std::exchange(cloth.may_go_over, may_go_over);
    if (update.state) cloth.fault = update.fault;
    return Status::Ok();
  }

  bool RunsAhead() const override {
    return first_->device() != nullptr && first_->device()->RunsAhead();
  }

  std::unique_ptr<PendingRead> BeginRead(const ReadRequest& request) override {
    if (elsewhere_ == 0) return drape::BeginRead(*first_, request);
    std::vector<ClothHandle> first, second;
    std::vector<ClothRows> rows;
    for (const ClothHandle handle : request.cloths) {
      const Cloth& cloth = cloths_.at(handle);
      (cloth.is_second ? second : first).push_back(cloth.inner);
      rows.push_back({cloth.is_second, RowsOf(request.particles, cloth.model->particle_count())});
    }
    ReadRequest of_first = request, of_second = request;
    of_first.cloths = first;
    of_second.cloths = second;
    if (second.empty()) return drape::BeginRead(*first_, of_first);
    if (first.empty()) return drape::BeginRead(*second_, of_second);
    auto begun = drape::BeginRead(*first_, of_first);
    return std::make_unique<PendingReadOfBoth>(
        std::move(begun), drape::BeginRead(*second_, of_second), std::move(rows));
  }

  bool IsReadyToMeasure() override {
    return first_->device() == nullptr || first_->device()->IsReadyToMeasure();
  }

  bool IsReadyToTellImpulses(ClothHandle handle) override {
    const Cloth& cloth = cloths_.at(handle);
    DeviceBackend* const device = Home(cloth.is_second).device();
    return device == nullptr || device->IsReadyToTellImpulses(cloth.inner);
  }

  std::shared_ptr<DeviceCopy> CopyOnDevice(const ReadRequest& request) override {
    if (first_->device() == nullptr) return nullptr;
    std::vector<ClothHandle> inner;
    for (const ClothHandle handle : request.cloths) {
      const Cloth& cloth = cloths_.at(handle);
      if (cloth.is_second) return nullptr;
      inner.push_back(cloth.inner);
    }
    ReadRequest of_first = request;
    of_first.cloths = inner;
    return first_->device()->CopyOnDevice(of_first);
  }

 private:
  // What steps and writes have set.
  struct Driven {
    std::vector<Grip> held{};  // where the last step left what it held, if that is still so
    std::optional<std::vector<Eigen::Vector3d>> pin_targets_m{};  // of a write since then
    std::vector<double> rest_lengths_m{};                         // empty: those of the model
  };

  struct Cloth {
    std::shared_ptr<const SceneModel> model;
    ClothParameters parameters;  // as written; steps move its colliders on
    bool is_second = false;
    // In steps that pull it; the first backend steps it in others. Its colliders do not move.
    bool may_go_over = false;
    Driven driven{};
    ClothHandle inner = {};  // that of its backend
    FaultReason fault = FaultReason::kNone;
    bool is_told_to_stay = false;  // the log says that there was no room for it to go over
  };

  // What a step holds of the cloth and where to, as precisely as the backends count. Pins that the
  // step has no targets for are left out, but for those of a write: they stay.
  std::vector<Grip> HeldIn(const Cloth& cloth, const StepItem& item) const;

  // Whether the first backend does not know it by this handle.
  static bool IsElsewhere(ClothHandle handle, const Cloth& cloth) {
    return cloth.is_second || cloth.inner != handle;
  }
  Backend& Home(bool is_second) { return is_second ? *second_ : *first_; }

  bool MayGoOver(const SceneModel& model, const ClothParameters& parameters) const {
    return first_description_.can_step && first_description_.Steps(model, parameters) &&
           HasSurfaceContactsPulled(model, parameters);
  }

  // Brings every cloth to the backend that does this step of it. One for which there is no room
  // stays where it is: there its edges may be caught.
  void GoOver(std::span<const StepItem> items) {
    for (size_t k = 0; may_go_over_ > 0 && k < items.size(); ++k) {
      Cloth& cloth = cloths_.at(items[k].cloth);
      if (!cloth.may_go_over || cloth.fault != FaultReason::kNone) continue;
      if (IsPulled(cloth, items[k]) == cloth.is_second) continue;
      ClothUpdate update;
      update.pin_targets_m = cloth.driven.pin_targets_m;
      if (!cloth.driven.rest_lengths_m.empty()) {
        update.rest_lengths_m = cloth.driven.rest_lengths_m;
      }
      const Status moved = Move(items[k].cloth, cloth.model, cloth.parameters, update);
      if (!moved.ok() && !std::exchange(cloth.is_told_to_stay, true)) {
        spdlog::warn("cloth_stays particles={} reason=\"{}\"", cloth.model->particle_count(),
                     moved.message());
      }
    }
  }

  bool IsPulled(Cloth& cloth, const StepItem& item);

  void NoteStep(std::span<const StepItem> items, std::span<const StepReport> reports);

  // `step(items, step_second)` steps those of the first backend, which may be none, and calls
  // step_second.
  template <class StepFirst>
  BatchReport StepBoth(std::span<const StepItem> items, const Pause& pause, const StepFirst& step) {
    GoOver(items);
    std::vector<bool> is_second;
    std::vector<StepItem> first, second;
    for (size_t k = 0; elsewhere_ > 0 && k < items.size(); ++k) {
      const Cloth& cloth = cloths_.at(items[k].cloth);
      is_second.push_back(cloth.is_second);
      (cloth.is_second ? second : first).emplace_back(items[k]).cloth = cloth.inner;
    }
    BatchReport batch, of_second;
    if (second.empty()) {
      batch = step(elsewhere_ > 0 ? std::span<const StepItem>(first) : items, [] {});
    } else {
      batch = step(first, [&] { of_second = second_->StepUntil(second, pause); });
      batch = Merged(std::move(batch), std::move(of_second), is_second, RunsAhead());
    }
    NoteStep(items, batch.reports);
    return batch;
  }

  // `update` of a cloth that the other backend steps from now on.
  Status Move(ClothHandle handle, std::shared_ptr<const SceneModel> model,
              const ClothParameters& parameters, const ClothUpdate& update);

  const std::unique_ptr<Backend> first_, second_;
  const BackendDescription first_description_, second_description_;
  std::unordered_map<ClothHandle, Cloth> cloths_;
  size_t elsewhere_ = 0;    // how many of them are
  size_t may_go_over_ = 0;  // how many of them may
};

std::vector<Grip> BackendPair::HeldIn(const Cloth& cloth, const StepItem& item) const {
  std::span<const Eigen::Vector3d> pin_targets_m = item.pin_targets_m;
  if (pin_targets_m.empty() && cloth.driven.pin_targets_m) {
    pin_targets_m = *cloth.driven.pin_targets_m;
  }
  std::vector<Grip> held;
  for (size_t k = 0; k < pin_targets_m.size(); ++k) {
    held.push_back({cloth.model->pins()[k], pin_targets_m[k]});
  }
  held.insert(held.end(), item.grips.begin(), item.grips.end());
  if (first_description_.scalar == ScalarType::kFloat64) return held;
  for (Grip& one : held) {
    for (double& x : one.target_m) {
      const volatile float rounded = static_cast<float>(x);  // GCC 12 drops what it can
      x = rounded;
    }
  }
  return held;
}

// As the backends ask (collider_contact.h): after a step what was held is where it was to be, as
// precisely as they count.
bool BackendPair::IsPulled(Cloth& cloth, const StepItem& item) {
  const std::vector<Grip> targets = HeldIn(cloth, item);
  std::vector<Grip>& held = cloth.driven.held;
  std::vector<uint32_t> unknown;
  for (const Grip& target : targets) {
    const auto is_its = [&](const Grip& one) { return one.particle == target.particle; };
    if (std::ranges::none_of(held, is_its)) unknown.push_back(target.particle);
  }
  if (!unknown.empty()) {
    std::ranges::sort(unknown);
    const StateColumns columns =
        Home(cloth.is_second).Read({.cloths = {&cloth.inner, 1}, .particles = unknown});
    for (size_t k = 0; k < unknown.size(); ++k) {
      held.push_back({unknown[k], VectorAt(columns.positions_m, k)});
    }
  }
  const double step_s = cloth.parameters.settings.time_step_s;
  return std::ranges::any_of(targets, [&](const Grip& target) {
    const auto is_its = [&](const Grip& one) { return one.particle == target.particle; };
    return Pulls(std::ranges::find_if(held, is_its)->target_m, target.target_m, step_s);
  });
}

void BackendPair::NoteStep(std::span<const StepItem> items, std::span<const StepReport> reports) {
  for (size_t k = 0; k < items.size(); ++k) {
    const StepItem& item = items[k];
    if (reports[k].is_undone) continue;
    const bool is_faulted = reports[k].fault != FaultReason::kNone;
    const bool is_plain = may_go_over_ == 0 && item.rest_lengths_m.empty();
    if (is_plain && !is_faulted) continue;
    Cloth& cloth = cloths_.at(item.cloth);
    if (is_faulted) {
      cloth.fault = reports[k].fault;
      continue;
    }
    if (!item.rest_lengths_m.empty()) {
      cloth.driven.rest_lengths_m.assign(item.rest_lengths_m.begin(), item.rest_lengths_m.end());
    }
    if (!cloth.may_go_over) continue;
    cloth.driven.held = HeldIn(cloth, item);
    cloth.driven.pin_targets_m.reset();
  }
}

Status BackendPair::Move(ClothHandle handle, std::shared_ptr<const SceneModel> model,
                         const ClothParameters& parameters, const ClothUpdate& update) {
  Cloth& cloth = cloths_.at(handle);
  Backend& from = Home(cloth.is_second);
  Backend& to = Home(!cloth.is_second);
  ClothUpdate rest = update;
  rest.model = nullptr;
  rest.parameters.reset();
  if (!rest.state) {
    const StateColumns columns = from.Read({{&cloth.inner, 1}, true, true});
    rest.state.emplace();
    for (size_t k = 0; k < model->particle_count(); ++k) {
      rest.state->positions_m.push_back(VectorAt(columns.positions_m, k));
      rest.state->velocities_m_per_s.push_back(VectorAt(columns.velocities_m_per_s, k));
    }
    rest.fault = cloth.fault;
    rest.may_cross_itself = from.MayCrossItself(cloth.inner);
  }
  DRAPE_ASSIGN_OR_RETURN(const ClothHandle inner,
                         to.Create(std::move(model), parameters, *rest.state));
  if (const Status written = to.Write(inner, rest); !written.ok()) {
    to.Destroy(inner);
    return written;
  }
  from.Destroy(cloth.inner);
  elsewhere_ -= IsElsewhere(handle, cloth);
  cloth.inner = inner;
  cloth.is_second = !cloth.is_second;
  elsewhere_ += IsElsewhere(handle, cloth);
  return Status::Ok();
}

}  // namespace

std::unique_ptr<Backend> PairBackends(std::unique_ptr<Backend> first,
                                      std::unique_ptr<Backend> second) {
  return std::make_unique<BackendPair>(std::move(first), std::move(second));
}

}  // namespace drape
