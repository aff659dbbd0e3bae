// The narrow interface between the scheduler and the code that computes cloths.
#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "server/core/ids.h"
#include "server/core/status.h"
#include "server/scene/particle_state.h"
#include "server/scene/scene_model.h"
#include "server/solver/cloth_parameters.h"
#include "server/solver/pause.h"
#include "server/solver/scalar_type.h"
#include "server/solver/step_report.h"

namespace drape {

class DeviceBackend;

struct BackendDescription {
  std::string name;    // "gl", "cpu", "reference"
  std::string device;  // "llvmpipe (LLVM 15.0.6), OpenGL 4.5 ...", "2 cores"
  // What of the device may decide bits: all of it, but the number of threads.
  std::string arithmetic{};
  ScalarType scalar = ScalarType::kFloat32;
  bool is_hardware_gpu = false;
  // StepItem::impulses takes hardly more time and memory than a step without. Else nobody asks for
  // them who may not need them.
  bool has_cheap_impulses = false;
  // Whether it can step such cloths. Empty: all. Pure; any thread.
  std::function<bool(const SceneModel&, const ClothParameters&)> can_step = {};
  bool Steps(const SceneModel& model, const ClothParameters& parameters) const {
    return !can_step || can_step(model, parameters);
  }
  // How it steps them: "resident", "tiled", "lanes", "single", "scalar". Pure; any thread.
  std::function<std::string(const SceneModel&, const ClothParameters&)> plan_of;
  // Does what takes long in a first Create of such a cloth, programs to compile, so that the device
  // thread need not; nothing else depends on it. May take seconds. Any thread but the device
  // thread, also after the backend has ended. Empty: there is nothing of the kind.
  std::function<void(const SceneModel&, const ClothParameters&)> prepare = {};
  // Makes what cloths share that have this model, which takes long for a large one: while somebody
  // holds the result, Create and Write of such a cloth find it. Any thread, also after the backend
  // has ended. std::bad_alloc, WorkStopped. Empty: there is nothing of the kind.
  std::function<std::shared_ptr<const void>(const std::shared_ptr<const SceneModel>&,
                                            const ClothParameters&, Interruption*)>
      make_shared_parts = {};
};

// A particle that a cloth holds in a step besides its pins.
struct Grip {
  uint32_t particle = 0;
  Eigen::Vector3d target_m;  // where it is at the end of the step, cloth frame
};

// The place of a cloth in its world: cloths that touch each other and are stepped together.
struct WorldPlace {
  uint64_t world = 0;  // a number that no other world of the batch has; 0: none
  // Of the cloth's frame in that of the world, which all cloths of the world share [m].
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();
};

// One cloth in a step. Pointers must stay valid during the call.
struct StepItem {
  ClothHandle cloth;
  // Pin positions at the end of the step, [pin_count] in the cloth frame; the pins move there in a
  // straight line. Empty: the targets of the last step or write.
  std::span<const Eigen::Vector3d> pin_targets_m;
  bool measure = false;  // fill StepReport::measured
  // Rest lengths at the end of the step, [constraint_count] in the order of the model; they change
  // linearly during the step. Only for cloths with rest lengths of their own (ClothUpdate). Empty:
  // those of the last step or write.
  std::span<const double> rest_lengths_m = {};
  // Collider motions from the start of the step, [collider_count]; only for cloths with
  // ClothParameters::collider_motions. Empty: they continue as the last step or write left them.
  // Those of bodies are where the last step has reported them (StepReport::bodies).
  std::span<const RigidMotion> collider_motions = {};
  // Held in this step alone, at most ClothParameters::max_grips: ascending, none of them a pin.
  // They move like pins, from where they are.
  std::span<const Grip> grips = {};
  // Limit on the sweeps per substep of this step, if lower than that of the cloth's settings; 0: no
  // limit of its own. The result is that of a cloth with this max_iterations, bit for bit.
  uint32_t max_iterations = 0;
  // Fill StepReport::impulses. Changes no bit of a state. Where the device has no room for them
  // they are NaN, and the log says so.
  bool impulses = false;
  // With `impulses`: StepImpulses::contacts, too.
  bool contact_impulses = false;
  // Of the steps before this one: it is done more dissipatively if it would add too much to that
  // (EnergyLimit::Excess_j). None: this step is judged by itself.
  std::optional<EnergyBalance> energy{};
  // Only of cloths with triangles and ClothParameters::is_in_world. All cloths of a world follow
  // each other in the batch, in an order that is always the same; none of them is faulted, or all
  // are. They have the same time step. All have the substeps of the one that has most, the least of
  // their limits on sweeps, and two steps only where all have.
  WorldPlace world{};
};

// The cloths of the first item's world, which are the first ones; 1: it is in none, or alone there.
inline size_t WorldSize(std::span<const StepItem> items) {
  const uint64_t world = items[0].world.world;
  size_t count = 1;
  while (world != 0 && count < items.size() && items[count].world.world == world) ++count;
  return count;
}

// The limit on the sweeps per substep.
inline uint32_t IterationsOf(const StepItem& item, const StepSettings& settings) {
  if (item.max_iterations == 0) return settings.max_iterations;
  return std::min(item.max_iterations, settings.max_iterations);
}

struct BatchReport {
  std::vector<StepReport> reports;  // one per item, same order
  uint32_t dispatch_count = 0;      // device dispatches of the whole batch (0 on CPU backends)
  int64_t upload_us = 0;
  int64_t device_us = 0;
  int64_t readback_us = 0;
};

// Packed x, y, z in the cloth frame, cloth after cloth in the requested order.
using ScalarColumn = std::variant<std::vector<float>, std::vector<double>>;
struct StateColumns {
  ScalarColumn positions_m;         // empty unless requested
  ScalarColumn velocities_m_per_s;  // empty unless requested
};
// The vector in row `row` of a column.
inline Eigen::Vector3d VectorAt(const ScalarColumn& column, size_t row) {
  return std::visit(
      [&](const auto& values) {
        const auto* xyz = values.data() + 3 * row;
        return Eigen::Vector3d(xyz[0], xyz[1], xyz[2]);
      },
      column);
}
// The rows that one cloth has in a column if `particles` are requested; empty: all of them.
inline uint32_t RowsOf(std::span<const uint32_t> particles, uint32_t particle_count) {
  return particles.empty() ? particle_count : static_cast<uint32_t>(particles.size());
}

struct ReadRequest {
  std::span<const ClothHandle> cloths;
  bool positions = true;
  bool velocities = false;
  // The same particles of every cloth: strictly ascending, each below every particle count; empty:
  // all. Used during the call only.
  std::span<const uint32_t> particles = {};
};

// Unset members stay as they are. A new model must have the same particle count; the state is kept
// unless given. Writing a state clears a fault, or sets `fault`.
struct ClothUpdate {
  std::shared_ptr<const SceneModel> model;
  std::optional<ClothParameters> parameters;
  std::optional<ParticleState> state;
  FaultReason fault = FaultReason::kNone;  // with `state`: whether that is the state of a fault
  bool may_cross_itself = true;            // Backend::MayCrossItself from then on
  std::optional<std::vector<Eigen::Vector3d>> pin_targets_m;  // [pin_count] of the (new) model
  // The cloth's own rest lengths from now on, [constraint_count] of the (new) model, each > 0. An
  // empty vector returns to the lengths of the model, as does a new model without this member.
  std::optional<std::vector<double>> rest_lengths_m;
  // Replaces the motions of the (new) parameters: [collider_count], or empty.
  std::optional<std::vector<RigidMotion>> collider_motions;
};

// Owns the device and the states of all cloths. Every call, construction and destruction included,
// is made on one thread, the device thread. Input is already validated: violations are programmer
// errors.
//
// Contract, tested on every implementation: the result of a cloth is the same bit for bit whatever
// else is in its batch and whatever slot it has, and so is that of a world; a faulted cloth keeps
// its last good state and never touches another one, and so do all of its world; a cloth occurs at
// most once in a batch.
class Backend {
 public:
  Backend() = default;
  virtual ~Backend() = default;
  Backend(const Backend&) = delete;
  Backend& operator=(const Backend&) = delete;

  virtual BackendDescription Describe() const = 0;

  // Pin targets start at the pins' positions in `state`. RESOURCE_EXHAUSTED when the device is
  // full; nothing is created then.
  virtual Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                                     const ClothParameters& parameters,
                                     const ParticleState& state) = 0;
  virtual void Destroy(ClothHandle cloth) = 0;

  // One time step of every item, all at once. Faulted cloths are left as they are and reported so.
  virtual BatchReport Step(std::span<const StepItem> items) = 0;
  // Step, but once `pause` is due steps that have not ended may be left undone
  // (StepReport::is_undone), those of a world together: a step that takes longer than anybody
  // expected ends there, and can be done by StepPiece. Its targets have to be told again. A backend
  // that cannot leave a step undone takes all of them.
  virtual BatchReport StepUntil(std::span<const StepItem> items, const Pause& /*pause*/) {
    return Step(items);
  }
  // Step for one cloth, or one world, whose step takes long, in pieces and with the same bits:
  // begins it, or goes on with it, until `pause` is due; none: it paused, and to readers the cloths
  // are as before. The items have every target (Track::SendAgain) and are otherwise the same in
  // each piece. A Step or a Write of one of the cloths drops what was begun, and so does another
  // StepPiece of it in other company. A backend that cannot pause takes the whole step.
  virtual std::optional<BatchReport> StepPiece(std::span<const StepItem> items,
                                               const Pause& /*pause*/) {
    return Step(items);
  }
  // Working memory of a step of these cloths by StepPiece while it is under way [bytes], about what
  // it is at most; 0: it is small.
  virtual uint64_t LongStepBytes(std::span<const ClothHandle> /*cloths*/) { return 0; }
  // Drops a step that StepPiece has begun, if there is one; the cloths are as before it.
  virtual void AbandonStep(ClothHandle /*cloth*/) {}
  virtual StateColumns Read(const ReadRequest& request) = 0;
  // Whether the next step looks for parts of the cloth that cross each other, which it then treats
  // differently. A state that is read and written back goes on with the same bits only if this
  // does, too. True on backends without self-collision.
  virtual bool MayCrossItself(ClothHandle /*cloth*/) { return true; }
  // RESOURCE_EXHAUSTED when the device has no room for the new model or colliders, INTERNAL
  // (SIZES_DISAGREE, update_check.h) when a list does not fit the cloth; nothing changes then.
  virtual Status Write(ClothHandle cloth, const ClothUpdate& update) = 0;

  // The additional interface of a backend with a device of its own (device_backend.h). Null: states
  // are in the host's memory and a step is over when Step returns; callers then use Step and Read.
  DeviceBackend* device() const { return device_; }

 private:
  friend class DeviceBackend;
  explicit Backend(DeviceBackend* device) : device_(device) {}

  DeviceBackend* const device_ = nullptr;
};

}  // namespace drape
