#include "server/solver/gl_compute/tiled_step.h"

#include <algorithm>

#include "server/solver/gl_compute/dispatch_pauses.h"
#include "server/solver/gl_compute/largest_sizes.h"
#include "server/solver/self_contact/self_contacts.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint32_t GroupsFor(uint32_t invocations, uint32_t local_size) {
  return std::max(1u, (invocations + local_size - 1) / local_size);
}

// One step of the cloths [first_item, first_item + cloths.size()) under the tiled plan.
class TiledStep {
 public:
  TiledStep(const StepKernels& kernels, uint32_t first_item, std::span<const GlCloth* const> cloths,
            gl::Buffer& dispatches, TiledProgress& progress, const Pause& pause)
      : kernels_(kernels),
        first_item_(first_item),
        item_count_(static_cast<uint32_t>(cloths.size())),
        largest_(FindLargest(cloths)),
        phase_count_(CountIf(StepStage::kSolveStrips, largest_.phases)),
        colour_count_(CountIf(StepStage::kSolveDistance, largest_.colours)),
        dispatches_(dispatches),
        progress_(progress),
        pauses_(progress, pause) {}

  // All that is left of the step, or until the pause. Returns whether it is complete.
  bool Run() {
    if (Has(Feature::kTolerance)) UploadDispatchArgs(progress_.dispatches);
    const bool is_complete = DoAll();
    if (!is_complete) KeepDispatchArgs();
    return is_complete;
  }
  uint32_t dispatch_count() const { return dispatch_count_; }

 private:
  using Part = TiledProgress::Part;

  // False: paused.
  bool DoAll() {
    if (!progress_.has_begun) {
      const bool has_begun = pauses_.DoSection([&] {
        DispatchParticles(*kernels_.tiled_begin, 0);
        FindReach();
      });
      if (!has_begun) return false;
      progress_.has_begun = true;
    }
    for (; progress_.substep < largest_.substeps.size(); ++progress_.substep) {
      if (!Advance()) return false;
      progress_.part = Part::kBeforeSweeps;
    }
    return pauses_.DoSection([&] {
      if (Has(Feature::kEnergyWatch)) DispatchElements(*kernels_.tiled_watch_energy, 0, 1);
      DispatchParticles(*kernels_.tiled_check, 0);
      DispatchParticles(*kernels_.tiled_commit, 0);
    });
  }

  // One substep, or what is left of it. False: paused.
  bool Advance() {
    const uint32_t substep = progress_.substep;
    if (progress_.part == Part::kBeforeSweeps) {
      if (!pauses_.DoSection([&] { BeforeSweeps(substep); })) return false;
      progress_.part = Part::kSweeps;
      progress_.sweep = 0;
    }
    if (progress_.part == Part::kSweeps) {
      for (; progress_.sweep < MostSweeps(); ++progress_.sweep) {
        if (!pauses_.DoSection([&] { Sweep(substep, progress_.sweep); })) return false;
      }
      progress_.part = Part::kIntegrate;
    }
    if (progress_.part == Part::kIntegrate) {
      const bool integrates = !IsIntegratedByNext(substep);
      if (integrates && !pauses_.DoSection([&] { Integrate(substep); })) return false;
      progress_.part = Part::kVelocitySweeps;
      progress_.sweep = 0;
    }
    if (progress_.part == Part::kVelocitySweeps) {
      const uint32_t sweeps = Has(StepStage::kSolveVelocity) ? largest_.velocity_iterations : 0;
      for (; progress_.sweep < sweeps; ++progress_.sweep) {
        if (!pauses_.DoSection([&] { SweepVelocities(substep, progress_.sweep); })) return false;
      }
      progress_.part = Part::kAfterSweeps;
    }
    return pauses_.DoSection([&] { AfterSweeps(substep); });
  }

  void EndDispatch() {
    DeviceBarrier();
    ++dispatch_count_;
    pauses_.EndDispatch();
  }

  // Whether nothing comes between its sweeps and the next prediction but integrate and
  // correct_velocity: then one kernel does all three.
  bool IsIntegratedByNext(uint32_t substep) const {
    const bool has_kicks = Has(StepStage::kApplySprings) || Has(StepStage::kApplyElastic) ||
                           Has(StepStage::kApplyWind) || Has(Feature::kSpringForces);
    return !has_kicks && !Has(StepStage::kSolveVelocity) && !Has(StepStage::kFindSelfContacts) &&
           !largest_.substeps[substep].is_last;
  }

  // One work group per cloth.
  void DispatchCloths(const gl::Program& kernel, uint32_t substep) {
    Prepare(kernel, substep);
    Dispatch(1, item_count_);
  }

  void BeforeSweeps(uint32_t substep) {
    const SubstepWork& work = largest_.substeps[substep];
    // At the places where the substep begins, which `predict` changes.
    if (Has(StepStage::kFindSelfContacts)) {
      DispatchCloths(*kernels_.tiled_find_self_contacts, substep);
    }
    if (work.kicks_before) Kick(substep, DRAPE_KICK_BEFORE);
    Predict(substep);
    if (work.kicks_within) Kick(substep, DRAPE_KICK_WITHIN);
    SolveElastic(substep);
    SolveHinges(substep);
    if (work.damps_twist) DampTwist(substep);
    Tether(substep);
    if (!Has(Feature::kTolerance)) return;
    PrepareSweepControl(*kernels_.tiled_begin_sweeps, substep, 0);
    Dispatch(1, 1);
  }

  // For the next piece.
  void KeepDispatchArgs() const {
    if (!Has(Feature::kTolerance)) return;
    progress_.dispatches.resize((end_sweep_index() + 1) * sizeof(shader::DispatchArgs));
    dispatches_.Download(0, progress_.dispatches);
  }

  bool Has(KernelTrait trait) const { return kernels_.variant.Has(trait); }
  uint32_t CountIf(StepStage stage, const std::vector<uint32_t>& sizes) const {
    return Has(stage) ? static_cast<uint32_t>(sizes.size()) : 0;
  }

  // Dispatch arguments of the sweeps: one per phase of strips, three of the refinement, one per
  // colour, one per colour of the joints, then both kinds of contacts, then the end of the sweep.
  uint32_t colours_index() const { return phase_count_ + (Has(StepStage::kRefine) ? 3 : 0); }
  uint32_t joints_index() const { return colours_index() + colour_count_; }
  uint32_t self_contacts_index() const {
    return joints_index() + static_cast<uint32_t>(largest_.joint_colours.size());
  }
  uint32_t contacts_index() const {
    return self_contacts_index() + (Has(StepStage::kSolveSelfContacts) ? 1 : 0);
  }
  uint32_t end_sweep_index() const { return contacts_index() + 1; }

  // `kept`: those of the piece before, if there was one.
  void UploadDispatchArgs(std::span<const std::byte> kept) {
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, dispatches_.name());
    if (!kept.empty()) return dispatches_.Upload(0, kept);
    const uint32_t local_size = kernels_.variant.local_size;
    std::vector<shader::DispatchArgs> args;
    for (uint32_t phase = 0; phase < phase_count_; ++phase) {
      args.push_back({StripGroups(phase), 0, 1, item_count_});
    }
    if (Has(StepStage::kRefine)) {
      args.push_back({GroupsFor(largest_.constraints, local_size), 0, 1, item_count_});
      args.push_back({GroupsFor(largest_.constraints, local_size), 0, 1, item_count_});
      args.push_back({1, 0, 1, item_count_});
    }
    for (uint32_t colour = 0; colour < colour_count_; ++colour) {
      args.push_back({GroupsFor(largest_.colours[colour], local_size), 0, 1, item_count_});
    }
    for (const uint32_t size : largest_.joint_colours) {
      args.push_back({GroupsFor(size, local_size), 0, 1, item_count_});
    }
    if (Has(StepStage::kSolveSelfContacts)) args.push_back({1, 0, 1, item_count_});
    args.push_back({GroupsFor(largest_.particles, local_size), 0, 1, item_count_});
    args.push_back({1, 0, 1, 1});
    dispatches_.Upload(0, std::as_bytes(std::span(args)));
  }

  // Work groups per cloth that solve a phase of strips.
  uint32_t StripGroups(uint32_t phase) const {
    if (kernels_.variant.strip_solve == StripSolve::kFromBothEnds) {
      return std::max(1u, largest_.phase_blocks[phase]);
    }
    return GroupsFor(largest_.phases[phase], kernels_.variant.local_size);
  }

  void Prepare(const gl::Program& kernel, uint32_t substep) {
    kernel.Use();
    kernel.SetUniform(DRAPE_UNIFORM_FIRST_ITEM, first_item_);
    kernel.SetUniform(DRAPE_UNIFORM_SUBSTEP, substep);
  }

  void Dispatch(uint32_t group_count_x, uint32_t group_count_y) {
    if (!pauses_.MayDispatch()) return;
    glDispatchCompute(group_count_x, group_count_y, 1);
    EndDispatch();
  }

  void DispatchIndirect(uint32_t index) {
    if (!pauses_.MayDispatch()) return;
    glDispatchComputeIndirect(static_cast<GLintptr>(index * sizeof(shader::DispatchArgs)));
    EndDispatch();
  }

  void DispatchElements(const gl::Program& kernel, uint32_t substep, uint32_t elements) {
    Prepare(kernel, substep);
    Dispatch(GroupsFor(elements, kernels_.variant.local_size), item_count_);
  }

  void DispatchParticles(const gl::Program& kernel, uint32_t substep) {
    DispatchElements(kernel, substep, largest_.particles);
  }

  // Finds the colliders that the cloths can meet.
  void FindReach() {
    if (!Has(Feature::kColliderReach)) return;
    const uint32_t pieces = GroupsFor(largest_.particles, DRAPE_MEASURE_PIECE);
    Prepare(*kernels_.tiled_find_range, 0);
    Dispatch(pieces, item_count_);
    DispatchElements(*kernels_.tiled_find_near, 0, DRAPE_LEFT_OUT_COLLIDERS);
  }

  // Springs, elastic elements and air act on the velocities before, within or after a substep.
  void Kick(uint32_t substep, uint32_t place) {
    ApplySprings(substep, place);
    ApplyElastic(substep, place);
    ApplyWind(substep, place);
  }

  void ApplySprings(uint32_t substep, uint32_t place) {
    if (!Has(StepStage::kApplySprings)) return;
    DispatchKick(*kernels_.tiled_spring_accelerations, substep, place, largest_.particles);
    DispatchKick(*kernels_.tiled_apply_springs, substep, place, largest_.particles);
  }

  void ApplyElastic(uint32_t substep, uint32_t place) {
    if (!Has(StepStage::kApplyElastic)) return;
    DispatchKick(*kernels_.tiled_elastic_impulses, substep, place, largest_.elastic_elements);
    DispatchKick(*kernels_.tiled_apply_elastic, substep, place, largest_.particles);
  }

  void ApplyWind(uint32_t substep, uint32_t place) {
    if (!Has(StepStage::kApplyWind)) return;
    DispatchKick(*kernels_.tiled_air_impulses, substep, place, largest_.triangles);
    DispatchKick(*kernels_.tiled_apply_wind, substep, place, largest_.particles);
  }

  void DispatchKick(const gl::Program& kernel, uint32_t substep, uint32_t place,
                    uint32_t elements) {
    kernel.SetUniform(DRAPE_UNIFORM_KICK_PLACE, place);
    DispatchElements(kernel, substep, elements);
  }

  void Predict(uint32_t substep) {
    if (Has(Feature::kSpringForces)) {
      DispatchKick(*kernels_.tiled_spring_accelerations, substep, DRAPE_KICK_BEFORE,
                   largest_.particles);
    }
    const bool integrates = substep > 0 && IsIntegratedByNext(substep - 1);
    kernels_.tiled_predict->SetUniform(DRAPE_UNIFORM_INTEGRATES, integrates ? 1 : 0);
    DispatchParticles(*kernels_.tiled_predict, substep);
  }

  void SolveElastic(uint32_t substep) {
    if (!Has(StepStage::kSolveElastic)) return;
    for (uint32_t family = 0; family < largest_.elastic_families.size(); ++family) {
      const ElasticWork& work = largest_.elastic_families[family];
      kernels_.tiled_solve_elastic->SetUniform(DRAPE_UNIFORM_PHASE, family);
      DispatchElements(*kernels_.tiled_solve_elastic, substep, work.lines);
      if (!work.has_cells) continue;
      kernels_.tiled_apply_cells->SetUniform(DRAPE_UNIFORM_PHASE, family);
      DispatchElements(*kernels_.tiled_apply_cells, substep, largest_.particles);
    }
  }

  void SolveHinges(uint32_t substep) {
    if (!Has(StepStage::kSolveHinges)) return;
    for (uint32_t stage = 0; stage < largest_.hinge_stages; ++stage) {
      kernels_.tiled_hinge_impulses->SetUniform(DRAPE_UNIFORM_PHASE, stage);
      DispatchElements(*kernels_.tiled_hinge_impulses, substep, largest_.elastic_elements);
      kernels_.tiled_solve_hinges->SetUniform(DRAPE_UNIFORM_PHASE, stage);
      DispatchParticles(*kernels_.tiled_solve_hinges, substep);
    }
  }

  void DampTwist(uint32_t substep) {
    if (!Has(StepStage::kDampTwist)) return;
    DispatchParticles(*kernels_.tiled_twist_changes, substep);
    DispatchParticles(*kernels_.tiled_damp_twist, substep);
  }

  void Tether(uint32_t substep) {
    if (Has(StepStage::kTether)) DispatchParticles(*kernels_.tiled_tether, substep);
  }

  void PrepareSweepControl(const gl::Program& kernel, uint32_t substep, uint32_t sweep) {
    Prepare(kernel, substep);
    kernel.SetUniform(DRAPE_UNIFORM_ITEM_COUNT, item_count_);
    kernel.SetUniform(DRAPE_UNIFORM_DISPATCH_COUNT, end_sweep_index() + 1);
    kernel.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
  }

  // Those after hard hits, which the kernels of other cloths leave out.
  uint32_t MostSweeps() const {
    return largest_.max_iterations +
           (Has(StepStage::kSolveSelfContacts) ? self_contact::kHitSweeps : 0);
  }

  void Sweep(uint32_t substep, uint32_t sweep) {
    SolveStrips(substep, sweep);
    Refine(substep, sweep);
    SolveDistance(substep, sweep);
    SolveJoints(substep, sweep);
    SolveSelfContacts(substep, sweep);
    SolveContacts(substep, sweep);
    if (!Has(Feature::kTolerance)) return;
    PrepareSweepControl(*kernels_.tiled_end_sweep, substep, sweep);
    DispatchIndirect(end_sweep_index());
  }

  void SolveStrips(uint32_t substep, uint32_t sweep) {
    if (phase_count_ == 0) return;
    const gl::Program& strips = *kernels_.tiled_solve_strips;
    Prepare(strips, substep);
    strips.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    for (uint32_t phase = 0; phase < phase_count_; ++phase) {
      strips.SetUniform(DRAPE_UNIFORM_PHASE, phase);
      if (Has(Feature::kTolerance)) {
        DispatchIndirect(phase);
      } else {
        Dispatch(StripGroups(phase), item_count_);
      }
    }
  }

  // Round by round: one work group per cloth sweeps over the links that the others have listed.
  void Refine(uint32_t substep, uint32_t sweep) {
    const auto found = largest_.refine_rounds.find({substep, sweep});
    if (found == largest_.refine_rounds.end()) return;
    for (uint32_t round = 0; round < found->second; ++round) {
      const auto dispatch = [&](const gl::Program& kernel, uint32_t index, uint32_t elements) {
        Prepare(kernel, substep);
        kernel.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
        kernel.SetUniform(DRAPE_UNIFORM_ROUND, round);
        DispatchSweepStage(index, elements);
      };
      dispatch(*kernels_.tiled_test_links, phase_count_, largest_.constraints);
      dispatch(*kernels_.tiled_collect_links, phase_count_ + 1, largest_.constraints);
      dispatch(*kernels_.tiled_refine, phase_count_ + 2, 1);
    }
  }

  void SolveDistance(uint32_t substep, uint32_t sweep) {
    if (colour_count_ == 0) return;
    const gl::Program& distance = *kernels_.tiled_solve_distance;
    Prepare(distance, substep);
    distance.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    for (uint32_t colour = 0; colour < colour_count_; ++colour) {
      distance.SetUniform(DRAPE_UNIFORM_COLOUR, colour);
      DispatchSweepStage(colours_index() + colour, largest_.colours[colour]);
    }
  }

  void SolveJoints(uint32_t substep, uint32_t sweep) {
    if (!Has(StepStage::kSolveJoints)) return;
    const gl::Program& joints = *kernels_.tiled_solve_joints;
    Prepare(joints, substep);
    joints.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    for (uint32_t colour = 0; colour < largest_.joint_colours.size(); ++colour) {
      joints.SetUniform(DRAPE_UNIFORM_COLOUR, colour);
      DispatchSweepStage(joints_index() + colour, largest_.joint_colours[colour]);
    }
  }

  void SolveSelfContacts(uint32_t substep, uint32_t sweep) {
    if (!Has(StepStage::kSolveSelfContacts)) return;
    const gl::Program& pairs = *kernels_.tiled_solve_self_contacts;
    Prepare(pairs, substep);
    pairs.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    DispatchSweepStage(self_contacts_index(), 1);
  }

  void SolveContacts(uint32_t substep, uint32_t sweep) {
    if (!Has(StepStage::kSolveContacts)) return;
    const gl::Program& contacts = *kernels_.tiled_solve_contacts;
    Prepare(contacts, substep);
    contacts.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    DispatchSweepStage(contacts_index(), largest_.particles);
  }

  void DispatchSweepStage(uint32_t index, uint32_t elements) {
    if (Has(Feature::kTolerance)) {
      DispatchIndirect(index);
    } else {
      Dispatch(GroupsFor(elements, kernels_.variant.local_size), item_count_);
    }
  }

  // With correct_velocity, unless a stage is between them.
  void Integrate(uint32_t substep) {
    DispatchParticles(*kernels_.tiled_integrate, substep);
    if (Has(StepStage::kGuardSelfContacts)) {
      DispatchCloths(*kernels_.tiled_guard_self_contacts, substep);
    }
  }

  void AfterSweeps(uint32_t substep) {
    if (Has(StepStage::kSolveVelocity) || Has(StepStage::kGuardSelfContacts)) {
      DispatchParticles(*kernels_.tiled_correct_velocity, substep);
    }
    PlacePins(substep);
    if (largest_.substeps[substep].kicks_after) Kick(substep, DRAPE_KICK_AFTER);
  }

  void SweepVelocities(uint32_t substep, uint32_t sweep) {
    SweepVelocities(substep, sweep, 0, largest_.colours);
    SweepVelocities(substep, sweep, 1, largest_.joint_colours);
  }

  void SweepVelocities(uint32_t substep, uint32_t sweep, uint32_t is_of_joints,
                       const std::vector<uint32_t>& colours) {
    const gl::Program& kernel = *kernels_.tiled_solve_velocity;
    kernel.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    kernel.SetUniform(DRAPE_UNIFORM_IS_OF_JOINTS, is_of_joints);
    for (uint32_t colour = 0; colour < colours.size(); ++colour) {
      kernel.SetUniform(DRAPE_UNIFORM_COLOUR, colour);
      DispatchElements(kernel, substep, colours[colour]);
    }
  }

  void PlacePins(uint32_t substep) {
    if (!Has(Feature::kPins) || !largest_.substeps[substep].is_last) return;
    DispatchElements(*kernels_.tiled_place_pins, substep, largest_.pins);
  }

  const StepKernels& kernels_;
  const uint32_t first_item_;
  const uint32_t item_count_;
  const LargestSizes largest_;
  const uint32_t phase_count_;   // phases of strips that are solved
  const uint32_t colour_count_;  // colours that are solved
  gl::Buffer& dispatches_;
  uint32_t dispatch_count_ = 0;
  TiledProgress& progress_;
  DispatchPauses pauses_;
};

}  // namespace

uint64_t MostDispatchesOfSweep(const SceneModel& model) {
  const uint64_t most =
      uint64_t{model.strips().phase_count()} + model.colour_count() + model.joint_colour_count();
  // Three cloths may each have the most of one kind. The constants are the refinement, the contacts
  // and the end of the sweep.
  return 3 * most + 6;
}

uint32_t StepTiled(const VariantGroup& group, const DispatchLimits& limits,
                   gl::Buffer& dispatches) {
  uint32_t dispatch_count = 0;
  group.BindScratch();
  const std::span<const GlCloth* const> cloths(group.cloths);
  for (size_t first = 0; first < cloths.size(); first += limits.group_count_y) {
    const size_t count = std::min<size_t>(cloths.size() - first, limits.group_count_y);
    TiledProgress progress;
    const Pause never = Pause::Never();
    TiledStep step(*group.kernels, group.first_item + static_cast<uint32_t>(first),
                   cloths.subspan(first, count), dispatches, progress, never);
    step.Run();
    dispatch_count += step.dispatch_count();
  }
  return dispatch_count;
}

bool ContinueTiled(const VariantGroup& cloth, gl::Buffer& dispatches, TiledProgress& progress,
                   const Pause& pause, uint32_t& dispatch_count) {
  cloth.BindScratch();
  TiledStep step(*cloth.kernels, cloth.first_item, cloth.cloths, dispatches, progress, pause);
  const bool is_complete = step.Run();
  dispatch_count += step.dispatch_count();
  return is_complete;
}

}  // namespace drape
