// One cloth as the host sees it, and how it is described to the kernels.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "server/solver/cloth_parameters.h"
#include "server/solver/gl_compute/device_map.h"
#include "server/solver/gl_compute/device_model.h"
#include "server/solver/gl_compute/free_list.h"
#include "server/solver/gl_compute/impulse_words.h"
#include "server/solver/gl_compute/kernel_costs.h"
#include "server/solver/gl_compute/kernels.h"
#include "server/solver/gl_compute/layouts.h"
#include "server/solver/gl_compute/scratch_pool.h"
#include "server/solver/step_plan.h"
#include "server/solver/step_report.h"
#include "shaders/interface/cloth_record.h"
#include "shaders/interface/self_contact_record.h"

namespace drape {

// How a cloth is stepped: what follows from its plan.
struct GlScheme {
  StepPlan plan;
  const StepKernels* kernels = nullptr;
  uint64_t part_count = 1;  // dispatches of the resident step
  LoopCosts costs{};        // of the resident step
  ScratchRange scratch{};
  shader::ScratchLayout scratch_layout{};  // within scratch
  // Of a cloth that touches itself: counts, places of the model in Models, behind the layout in
  // scratch.
  shader::SelfContactRecord contacts{};
  // Once a step by this scheme was asked for impulses, and there is room.
  ImpulseRoom impulses{};
};

// What is done about a step that gains energy for no reason (solver/energy_watch.h).
enum class GainResponse {
  kStepAgain,   // it is not committed
  kWarn,        // there is no calmer scheme, or no room for one
  kNotWatched,  // it is the calmer scheme's
};

struct GlCloth : GlScheme {
  std::shared_ptr<const DeviceModel> model{};
  std::vector<std::shared_ptr<const DeviceMap>> maps{};  // of the distance maps, in their order
  ClothParameters parameters{};
  uint32_t max_iterations = 0;  // sweeps per substep at most, of the step under way
  FaultReason fault = FaultReason::kNone;
  WordRange state{};  // positions, then velocities
  WordRange parameter_words{};
  shader::ParameterLayout parameter_layout{};  // within parameter_words

  // Of a cloth that touches itself: its SelfContactRecord and what crosses, in the parameters.
  WordRange contact_words{};
  uint32_t pair_capacity = 0;       // of its next scheme
  bool may_take_more_pairs = true;  // there is room for more than pair_capacity
  uint32_t pairs_wanted = 0;        // more than there is room for: the step was not committed
  bool may_cross_itself = true;     // until a step has found that nothing crosses
  std::vector<uint32_t> crossing_flags{};  // of particles of what began crossing; empty: none did

  GainResponse gain_response = GainResponse::kWarn;
  bool must_step_again = false;  // the step under way has gained energy, and was not committed
  // The calmer scheme once a step needed it; the usual one while that is in use.
  std::optional<GlScheme> other_scheme{};

  // How the colliders move in the last step, as packed; empty: they rest as described.
  std::vector<uint32_t> motion_words{};

  // What the grips held in the last step, [max_grips]; DRAPE_NO_PARTICLE: they are open.
  std::vector<uint32_t> grip_words{};
  std::vector<uint32_t> grip_target_words{};  // [3 * max_grips]

  // Rest lengths of the cloth's own at the end of the last step, [constraint_count] float bits;
  // empty: those of the model.
  std::vector<uint32_t> length_words{};
  bool are_lengths_moving = false;  // the last step changed them

  bool tells_impulses = false;      // the step under way does
  bool tells_contacts = false;      // it is asked for those of each particle, too
  bool has_warned_of_room = false;  // that there is none for impulses

  GlScheme& scheme() { return *this; }
  // Those of the step under way.
  const StepKernels* step_kernels() const { return tells_impulses ? impulses.kernels : kernels; }
  bool touches_itself() const { return plan.Has(StepStage::kFindSelfContacts); }
  // The step under way is to be done again.
  bool must_be_redone() const { return must_step_again || pairs_wanted > 0; }
  bool has_own_lengths() const { return !length_words.empty(); }
  uint32_t particle_count() const { return model->model->particle_count(); }
  uint32_t pin_count() const { return model->model->pin_count(); }
};

// Pure. The second: of a cloth that touches itself.
shader::ClothRecord MakeClothRecord(const GlCloth& cloth);
shader::SelfContactRecord MakeSelfContactRecord(const GlCloth& cloth);

}  // namespace drape
