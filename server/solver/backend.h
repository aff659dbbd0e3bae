// The narrow interface between what schedules cloths and what computes them.
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
#include "server/solver/scalar_type.h"
#include "server/solver/step_report.h"

namespace drape {

namespace gl {
struct SharedCopy;  // server/gl/shared_copy.h; only gl_compute and what draws look inside
}

struct BackendDescription {
  std::string name;    // "gl", "cpu", "reference"
  std::string device;  // "llvmpipe (LLVM 15.0.6), OpenGL 4.5 ...", "2 cores"
  ScalarType scalar = ScalarType::kFloat32;
  bool is_hardware_gpu = false;
};

// One cloth in a step. Pointers must stay valid during the call.
struct StepItem {
  ClothHandle cloth;
  // Where the pins are at the end of the step, [pin_count] in the cloth frame; they move there in a
  // straight line. Empty: the targets of the last step or write.
  std::span<const Eigen::Vector3d> pin_targets_m;
  bool measure = false;  // fill StepReport::measured
  // The rest lengths at the end of the step, [constraint_count] in the order of the model; they
  // change linearly within it. Only of cloths with rest lengths of their own (ClothUpdate). Empty:
  // those of the last step or write.
  std::span<const double> rest_lengths_m = {};
  // How the colliders move from the start of the step on, [collider_count]; only of cloths with
  // ClothParameters::collider_motions. Empty: on from where the last step or write left them.
  std::span<const RigidMotion> collider_motions = {};
  // Sweeps per substep at most in this step, if fewer than the cloth's settings say; 0: as they
  // say. The result is that of a cloth with this max_iterations, bit for bit.
  uint32_t max_iterations = 0;
};

// Sweeps per substep at most.
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

// Packed x, y, z in the cloth frame, cloth after cloth in the order asked for.
using ScalarColumn = std::variant<std::vector<float>, std::vector<double>>;
struct StateColumns {
  ScalarColumn positions_m;         // empty unless asked for
  ScalarColumn velocities_m_per_s;  // empty unless asked for
};
// How many rows of a column are a cloth's, of which `particles` are asked for; empty: all.
inline uint32_t RowsOf(std::span<const uint32_t> particles, uint32_t particle_count) {
  return particles.empty() ? particle_count : static_cast<uint32_t>(particles.size());
}

struct ReadRequest {
  std::span<const ClothHandle> cloths;
  bool positions = true;
  bool velocities = false;
  // Of each cloth, strictly ascending, each below its particle count; empty: all. Used during the
  // call only.
  std::span<const uint32_t> particles = {};
};

// States on their way to the host. On the device thread, before the backend is destroyed.
class PendingRead {
 public:
  virtual ~PendingRead() = default;
  // Waits until they are there. Once.
  virtual StateColumns Take() = 0;
};

// What to change; unset members stay. A new model must have the same particle count; the state is
// kept unless given. Writing a state clears a fault.
struct ClothUpdate {
  std::shared_ptr<const SceneModel> model;
  std::optional<ClothParameters> parameters;
  std::optional<ParticleState> state;
  std::optional<std::vector<Eigen::Vector3d>> pin_targets_m;  // [pin_count] of the (new) model
  // Rest lengths of the cloth's own from now on, [constraint_count] of the (new) model, each > 0;
  // an empty vector gives them up for those of the model, as does a new model without them.
  std::optional<std::vector<double>> rest_lengths_m;
  // Replaces those of the (new) parameters: [collider_count], or empty.
  std::optional<std::vector<RigidMotion>> collider_motions;
};

// Owns the device and the states of all cloths. Every call, construction and destruction included,
// on one thread, the device thread. Input is already validated: violations are programmer errors.
//
// Contract, tested on every implementation: the result of a cloth is the same bit for bit whatever
// else is in its batch and whatever slot it has; a faulted cloth keeps its last good state and
// never touches another one; a cloth occurs at most once in a batch.
class Backend {
 public:
  virtual ~Backend() = default;

  virtual BackendDescription Describe() const = 0;
  // "resident", "tiled", "lanes", "single", "scalar": how a cloth of this model is stepped. A
  // function of the model alone.
  virtual std::string PlanOf(const SceneModel& model) const = 0;

  // Pin targets start at the pins' positions in `state`. RESOURCE_EXHAUSTED when the device is
  // full; nothing is created then.
  virtual Result<ClothHandle> Create(std::shared_ptr<const SceneModel> model,
                                     const ClothParameters& parameters,
                                     const ParticleState& state) = 0;
  virtual void Destroy(ClothHandle cloth) = 0;

  // One time step of every item, in one go. Faulted cloths are left as they are and reported so.
  virtual BatchReport Step(std::span<const StepItem> items) = 0;
  // The same for items, not none. A backend whose device works by itself (RunsAhead) calls
  // `meanwhile` once before it waits for the device; it may take pending reads there, and nothing
  // else. Others do not call it.
  virtual BatchReport StepAhead(std::span<const StepItem> items,
                                const std::function<void()>& /*meanwhile*/) {
    return Step(items);
  }
  virtual bool RunsAhead() const { return false; }
  virtual StateColumns Read(const ReadRequest& request) = 0;
  // The states as Read would give them now, whatever is stepped, written or destroyed before they
  // are taken.
  virtual std::unique_ptr<PendingRead> BeginRead(const ReadRequest& request);
  // The columns (float32: all positions, then all velocities) copied on the device, for another
  // context of its share group: nothing passes through the host and the device is not waited for.
  // Always of whole cloths: `request.particles` is empty. Null where states are in the host's
  // memory anyway or the device has no room: Read them.
  virtual std::shared_ptr<gl::SharedCopy> CopyOnDevice(const ReadRequest&) { return nullptr; }
  // RESOURCE_EXHAUSTED when the device has no room for the new model or colliders; nothing changes
  // then.
  virtual Status Write(ClothHandle cloth, const ClothUpdate& update) = 0;
};

}  // namespace drape
