#include "server/solver/backend_pair.h"

#include <algorithm>
#include <unordered_map>
#include <utility>

#include "server/core/check.h"
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
    return description;
  }

  Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                             const ClothParameters& parameters,
                             const ParticleState& state) override {
    Cloth cloth{.model = model, .is_second = !first_description_.Steps(*model, parameters)};
    DRAPE_ASSIGN_OR_RETURN(cloth.inner,
                           Home(cloth.is_second).Create(std::move(model), parameters, state));
    ClothHandle handle = cloth.inner;
    if (cloth.is_second) handle.slot |= kSecondBit;
    elsewhere_ += IsElsewhere(handle, cloth);
    cloths_[handle] = std::move(cloth);
    return handle;
  }

  void Destroy(ClothHandle handle) override {
    const Cloth& cloth = cloths_.at(handle);
    Home(cloth.is_second).Destroy(cloth.inner);
    elsewhere_ -= IsElsewhere(handle, cloth);
    cloths_.erase(handle);
  }

  BatchReport Step(std::span<const StepItem> items) override {
    return StepBoth(items, [this](std::span<const StepItem> its, const auto& step_second) {
      BatchReport batch = its.empty() ? BatchReport{} : first_->Step(its);
      step_second();
      return batch;
    });
  }

  BatchReport StepAhead(std::span<const StepItem> items,
                        const std::function<void()>& meanwhile) override {
    if (!RunsAhead()) return Step(items);
    return StepBoth(items, [&](std::span<const StepItem> its, const auto& step_second) {
      if (its.empty()) {
        meanwhile();
        step_second();
        return BatchReport{};
      }
      return first_->device()->StepAhead(its, [&] {
        meanwhile();
        step_second();
      });
    });
  }

  std::optional<BatchReport> StepPiece(std::span<const StepItem> items,
                                       const Pause& pause) override {
    std::vector<StepItem> inner(items.begin(), items.end());
    for (StepItem& item : inner) item.cloth = cloths_.at(item.cloth).inner;
    std::optional<BatchReport> batch =
        Home(cloths_.at(items[0].cloth).is_second).StepPiece(inner, pause);
    if (batch) NoteFaults(items, batch->reports);
    return batch;
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
    const bool is_second =
        update.parameters ? !first_description_.Steps(*model, *update.parameters) : cloth.is_second;
    if (is_second == cloth.is_second) {
      DRAPE_RETURN_IF_ERROR(Home(is_second).Write(cloth.inner, update));
    } else {
      DRAPE_RETURN_IF_ERROR(Move(handle, model, update));
    }
    cloth.model = model;
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
  struct Cloth {
    std::shared_ptr<const SceneModel> model;
    bool is_second = false;
    ClothHandle inner = {};  // that of its backend
    FaultReason fault = FaultReason::kNone;
  };

  // Whether the first backend does not know it by this handle.
  static bool IsElsewhere(ClothHandle handle, const Cloth& cloth) {
    return cloth.is_second || cloth.inner != handle;
  }
  Backend& Home(bool is_second) { return is_second ? *second_ : *first_; }

  void NoteFaults(std::span<const StepItem> items, std::span<const StepReport> reports) {
    for (size_t k = 0; k < items.size(); ++k) {
      if (reports[k].fault == FaultReason::kNone) continue;
      cloths_.at(items[k].cloth).fault = reports[k].fault;
    }
  }

  // `step(items, step_second)` steps those of the first backend, which may be none, and calls
  // step_second.
  template <class StepFirst>
  BatchReport StepBoth(std::span<const StepItem> items, const StepFirst& step) {
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
      batch = step(first, [&] { of_second = second_->Step(second); });
      batch = Merged(std::move(batch), std::move(of_second), is_second, RunsAhead());
    }
    NoteFaults(items, batch.reports);
    return batch;
  }

  // `update` of a cloth that the other backend steps from now on.
  Status Move(ClothHandle handle, std::shared_ptr<const SceneModel> model,
              const ClothUpdate& update);

  const std::unique_ptr<Backend> first_, second_;
  const BackendDescription first_description_, second_description_;
  std::unordered_map<ClothHandle, Cloth> cloths_;
  size_t elsewhere_ = 0;  // how many of them are
};

Status BackendPair::Move(ClothHandle handle, std::shared_ptr<const SceneModel> model,
                         const ClothUpdate& update) {
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
                         to.Create(std::move(model), *update.parameters, *rest.state));
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
