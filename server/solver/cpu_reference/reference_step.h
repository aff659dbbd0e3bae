// One time step of one cloth, or of a world, written from the equations in server/solver/method.md.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/solver/cpu_reference/reference_cloth.h"
#include "server/solver/pause.h"
#include "server/solver/self_contact/crossing_search.h"
#include "server/solver/step_report.h"

namespace drape {

// What a report of a step is to tell.
struct AskedOfStep {
  bool measure = false;                   // StepReport::measured
  bool impulses = false;                  // StepReport::impulses
  bool contact_impulses = false;          // StepImpulses::contacts
  std::optional<EnergyBalance> energy{};  // StepItem::energy
};

// One of the cloths of a step.
struct SteppedReference {
  ReferenceCloth* cloth = nullptr;
  AskedOfStep asked{};
  Eigen::Vector3d origin_m = Eigen::Vector3d::Zero();  // of its frame in that of its world
};

// A step of a cloth, or of all cloths of a world in its order: their pins to pin_targets_m, by at
// most max_iterations sweeps per substep; it may be done in pieces. The cloths outlive it and are
// changed by nobody else meanwhile.
class ReferenceStep {
 public:
  // `surface`: what touches in this step; null: nothing does.
  ReferenceStep(std::vector<SteppedReference> cloths, std::shared_ptr<const ContactSurface> surface,
                uint32_t max_iterations);
  ~ReferenceStep();

  // Begins or goes on until `pause` is due; none: it paused, and the cloths are as before, as they
  // are if `interruption` throws WorkStopped. That is the same in all calls; null: no stage is
  // interrupted. Cloths that are faulted keep their state, and if one becomes so, all of them do. A
  // report of each.
  std::optional<std::vector<StepReport>> Continue(const Pause& pause,
                                                  Interruption* interruption = nullptr);

 private:
  struct UnderWay;

  void Begin(bool is_calmer, Interruption* interruption);
  // The end of all substeps; false: the step is to be done again by the calmer scheme.
  bool End(std::vector<StepReport>& reports, Interruption* interruption);
  // Of the states that the step ends with. Empty: nobody asks, or nothing touches.
  std::vector<self_contact::SelfContactMeasures> MeasureContacts(bool is_good,
                                                                 Interruption* interruption) const;
  void Measure(std::span<const self_contact::SelfContactMeasures> contacts,
               std::vector<StepReport>& reports) const;

  const std::vector<SteppedReference> cloths_;
  const std::shared_ptr<const ContactSurface> surface_;
  const uint32_t max_iterations_;
  std::vector<ClothParameters> parameters_;  // of each in its world
  bool has_gained_energy_ = false;           // once: then it is done again by the calmer scheme
  std::unique_ptr<UnderWay> under_way_;      // null: it has not begun, or the cloths are faulted
};

// The whole step of one cloth at once.
StepReport StepReferenceCloth(ReferenceCloth& cloth, const AskedOfStep& asked,
                              uint32_t max_iterations);

}  // namespace drape
