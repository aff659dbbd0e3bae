#include "server/solver/gl_compute/step_plans.h"
#include "server/solver/gl_compute/plan_on_device.h"

#include <algorithm>
#include <map>
#include <utility>

#include "server/solver/substep_schedule.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint32_t GroupsFor(uint32_t invocations, uint32_t local_size) {
  return std::max(1u, (invocations + local_size - 1) / local_size);
}

// Largest of each size over the cloths of a group: how far the loops of the host go. A cloth with
// less has its work groups return at once, so the bits of a cloth do not depend on the others.
struct LargestSizes {
  uint32_t particles = 0;
  uint32_t pins = 0;
  uint32_t triangles = 0;
  uint32_t elastic_elements = 0;
  uint32_t constraints = 0;
  uint32_t substeps = 0;
  uint32_t max_iterations = 0;
  uint32_t velocity_iterations = 0;
  std::vector<uint32_t> phases;         // [phase] strips
  std::vector<uint32_t> colours;        // [colour] constraints
  std::vector<uint32_t> joint_colours;  // [colour] joints
  // Most rounds of refinement that follow a sweep of a substep, by {substep, sweep}.
  std::map<std::pair<uint32_t, uint32_t>, uint32_t> refine_rounds;
};

void Enlarge(const std::vector<uint32_t>& sizes, std::vector<uint32_t>& largest) {
  if (largest.size() < sizes.size()) largest.resize(sizes.size());
  for (size_t c = 0; c < sizes.size(); ++c) largest[c] = std::max(largest[c], sizes[c]);
}

LargestSizes FindLargest(std::span<const GlCloth* const> cloths) {
  LargestSizes largest;
  for (const GlCloth* cloth : cloths) {
    const StepSettings& settings = cloth->parameters.settings;
    largest.particles = std::max(largest.particles, cloth->particle_count());
    largest.pins = std::max(largest.pins, cloth->pin_count());
    largest.triangles =
        std::max(largest.triangles, static_cast<uint32_t>(cloth->model->model->triangles().size()));
    largest.elastic_elements =
        std::max(largest.elastic_elements, cloth->model->model->elastic_count());
    largest.constraints = std::max(largest.constraints, cloth->model->model->constraint_count());
    const SubstepSchedule schedule =
        PlanOnDevice(*cloth->model->model, cloth->parameters, cloth->has_own_lengths()).schedule;
    largest.substeps = std::max(largest.substeps, schedule.size());
    largest.max_iterations = std::max(largest.max_iterations, cloth->max_iterations);
    largest.velocity_iterations =
        std::max(largest.velocity_iterations, settings.velocity_iterations);
    if (cloth->kernels->variant.has_refinement) {
      const SolverChoice solver =
          PlanOnDevice(*cloth->model->model, cloth->parameters, cloth->has_own_lengths()).solver;
      uint32_t& rounds = largest.refine_rounds[{schedule.size() - 1, cloth->max_iterations - 1}];
      rounds = std::max(rounds, solver.refine_rounds);
    }
    Enlarge(cloth->model->phase_sizes, largest.phases);
    Enlarge(cloth->model->colour_sizes, largest.colours);
    Enlarge(cloth->model->joint_colour_sizes, largest.joint_colours);
  }
  return largest;
}

// One step of the cloths [first_item, first_item + cloths.size()) under the tiled plan.
class TiledStep {
 public:
  TiledStep(const StepKernels& kernels, uint32_t first_item, std::span<const GlCloth* const> cloths,
            gl::Buffer& dispatches)
      : kernels_(kernels),
        first_item_(first_item),
        item_count_(static_cast<uint32_t>(cloths.size())),
        largest_(FindLargest(cloths)),
        phase_count_(kernels.variant.has_strips ? static_cast<uint32_t>(largest_.phases.size())
                                                : 0),
        colour_count_(kernels.variant.has_colours ? static_cast<uint32_t>(largest_.colours.size())
                                                  : 0),
        dispatches_(dispatches) {}

  uint32_t Run() {
    if (kernels_.variant.has_tolerance) UploadDispatchArgs();
    DispatchParticles(*kernels_.tiled_begin, 0);
    FindReach();
    Kick(0, DRAPE_KICK_BEFORE);
    for (uint32_t substep = 0; substep < largest_.substeps; ++substep) {
      Predict(substep);
      if (substep > 0 && kernels_.variant.has_two_steps) Kick(substep, DRAPE_KICK_WITHIN);
      DampTwist(substep);
      Tether(substep);
      Solve(substep);
      Integrate(substep);
      if (substep == 0 || !kernels_.variant.has_two_steps) Kick(substep, DRAPE_KICK_AFTER);
    }
    DispatchParticles(*kernels_.tiled_check, 0);
    DispatchParticles(*kernels_.tiled_commit, 0);
    return dispatch_count_;
  }

 private:
  // Dispatch arguments of the sweeps: one per phase of strips, three of the refinement, one per
  // colour, one per colour of the joints, then the contacts, then the end of the sweep.
  uint32_t colours_index() const {
    return phase_count_ + (kernels_.variant.has_refinement ? 3 : 0);
  }
  uint32_t joints_index() const { return colours_index() + colour_count_; }
  uint32_t contacts_index() const {
    return joints_index() + static_cast<uint32_t>(largest_.joint_colours.size());
  }
  uint32_t end_sweep_index() const { return contacts_index() + 1; }

  void UploadDispatchArgs() {
    const uint32_t local_size = kernels_.variant.local_size;
    std::vector<shader::DispatchArgs> args;
    for (uint32_t phase = 0; phase < phase_count_; ++phase) {
      args.push_back({GroupsFor(largest_.phases[phase], local_size), 0, 1, item_count_});
    }
    if (kernels_.variant.has_refinement) {
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
    args.push_back({GroupsFor(largest_.particles, local_size), 0, 1, item_count_});
    args.push_back({1, 0, 1, 1});
    dispatches_.Upload(0, std::as_bytes(std::span(args)));
    glBindBuffer(GL_DISPATCH_INDIRECT_BUFFER, dispatches_.name());
  }

  void Prepare(const gl::Program& kernel, uint32_t substep) {
    kernel.Use();
    kernel.SetUniform(DRAPE_UNIFORM_FIRST_ITEM, first_item_);
    kernel.SetUniform(DRAPE_UNIFORM_SUBSTEP, substep);
  }

  void Dispatch(uint32_t group_count_x, uint32_t group_count_y) {
    glDispatchCompute(group_count_x, group_count_y, 1);
    DeviceBarrier();
    ++dispatch_count_;
  }

  void DispatchIndirect(uint32_t index) {
    glDispatchComputeIndirect(static_cast<GLintptr>(index * sizeof(shader::DispatchArgs)));
    DeviceBarrier();
    ++dispatch_count_;
  }

  void DispatchElements(const gl::Program& kernel, uint32_t substep, uint32_t elements) {
    Prepare(kernel, substep);
    Dispatch(GroupsFor(elements, kernels_.variant.local_size), item_count_);
  }

  void DispatchParticles(const gl::Program& kernel, uint32_t substep) {
    DispatchElements(kernel, substep, largest_.particles);
  }

  // Which colliders the cloths can meet.
  void FindReach() {
    if (kernels_.tiled_find_near == nullptr) return;
    const uint32_t pieces = GroupsFor(largest_.particles, DRAPE_MEASURE_PIECE);
    Prepare(*kernels_.tiled_find_range, 0);
    Dispatch(pieces, item_count_);
    DispatchElements(*kernels_.tiled_find_near, 0, DRAPE_LEFT_OUT_COLLIDERS);
  }

  // What acts on the velocities before, within or after a substep.
  void Kick(uint32_t substep, uint32_t place) {
    if (kernels_.tiled_kick != nullptr) {
      DispatchKick(*kernels_.tiled_spring_accelerations, substep, place, largest_.particles);
      DispatchKick(*kernels_.tiled_kick, substep, place, largest_.particles);
    }
    if (kernels_.tiled_apply_elastic != nullptr) {
      DispatchKick(*kernels_.tiled_elastic_impulses, substep, place, largest_.elastic_elements);
      DispatchKick(*kernels_.tiled_apply_elastic, substep, place, largest_.particles);
    }
    if (kernels_.tiled_apply_wind != nullptr) {
      DispatchKick(*kernels_.tiled_air_impulses, substep, place, largest_.triangles);
      DispatchKick(*kernels_.tiled_apply_wind, substep, place, largest_.particles);
    }
  }

  void DispatchKick(const gl::Program& kernel, uint32_t substep, uint32_t place,
                    uint32_t elements) {
    kernel.SetUniform(DRAPE_UNIFORM_KICK_PLACE, place);
    DispatchElements(kernel, substep, elements);
  }

  // Not every substep has it; the kernels know.
  void DampTwist(uint32_t substep) {
    if (kernels_.tiled_apply_twist == nullptr) return;
    DispatchParticles(*kernels_.tiled_twist_changes, substep);
    DispatchParticles(*kernels_.tiled_apply_twist, substep);
  }

  void Predict(uint32_t substep) {
    if (kernels_.variant.springs == KernelVariant::Springs::kInForce) {
      DispatchKick(*kernels_.tiled_spring_accelerations, substep, DRAPE_KICK_BEFORE,
                   largest_.particles);
    }
    DispatchParticles(*kernels_.tiled_predict, substep);
  }

  void Tether(uint32_t substep) {
    if (kernels_.tiled_tether != nullptr) DispatchParticles(*kernels_.tiled_tether, substep);
  }

  void PrepareSweepControl(const gl::Program& kernel, uint32_t substep, uint32_t sweep) {
    Prepare(kernel, substep);
    kernel.SetUniform(DRAPE_UNIFORM_ITEM_COUNT, item_count_);
    kernel.SetUniform(DRAPE_UNIFORM_DISPATCH_COUNT, end_sweep_index() + 1);
    kernel.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
  }

  void Solve(uint32_t substep) {
    const bool has_tolerance = kernels_.variant.has_tolerance;
    if (has_tolerance) {
      PrepareSweepControl(*kernels_.tiled_begin_sweeps, substep, 0);
      Dispatch(1, 1);
    }
    for (uint32_t sweep = 0; sweep < largest_.max_iterations; ++sweep) {
      Sweep(substep, sweep);
      if (!has_tolerance) continue;
      PrepareSweepControl(*kernels_.tiled_end_sweep, substep, sweep);
      DispatchIndirect(end_sweep_index());
    }
  }

  void Sweep(uint32_t substep, uint32_t sweep) {
    if (phase_count_ > 0) {
      const gl::Program& strips = *kernels_.tiled_solve_strips;
      Prepare(strips, substep);
      strips.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
      for (uint32_t phase = 0; phase < phase_count_; ++phase) {
        strips.SetUniform(DRAPE_UNIFORM_PHASE, phase);
        DispatchSweepStage(phase, largest_.phases[phase]);
      }
    }
    Refine(substep, sweep);
    if (colour_count_ > 0) {
      const gl::Program& distance = *kernels_.tiled_solve_distance;
      Prepare(distance, substep);
      distance.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
      for (uint32_t colour = 0; colour < colour_count_; ++colour) {
        distance.SetUniform(DRAPE_UNIFORM_COLOUR, colour);
        DispatchSweepStage(colours_index() + colour, largest_.colours[colour]);
      }
    }
    SolveJoints(substep, sweep);
    if (!kernels_.variant.has_contacts) return;
    Prepare(*kernels_.tiled_solve_contacts, substep);
    kernels_.tiled_solve_contacts->SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    DispatchSweepStage(contacts_index(), largest_.particles);
  }

  // What the strips have left far off, round by round; one work group per cloth sweeps over it.
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

  void SolveJoints(uint32_t substep, uint32_t sweep) {
    if (kernels_.tiled_solve_joints == nullptr) return;
    const gl::Program& joints = *kernels_.tiled_solve_joints;
    Prepare(joints, substep);
    joints.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    for (uint32_t colour = 0; colour < largest_.joint_colours.size(); ++colour) {
      joints.SetUniform(DRAPE_UNIFORM_COLOUR, colour);
      DispatchSweepStage(joints_index() + colour, largest_.joint_colours[colour]);
    }
  }

  void DispatchSweepStage(uint32_t index, uint32_t elements) {
    if (kernels_.variant.has_tolerance) {
      DispatchIndirect(index);
    } else {
      Dispatch(GroupsFor(elements, kernels_.variant.local_size), item_count_);
    }
  }

  void Integrate(uint32_t substep) {
    DispatchParticles(*kernels_.tiled_integrate, substep);
    if (kernels_.variant.has_velocity_stage) {
      for (uint32_t sweep = 0; sweep < largest_.velocity_iterations; ++sweep) {
        SolveVelocity(substep, sweep, false, largest_.colours);
        SolveVelocity(substep, sweep, true, largest_.joint_colours);
      }
      DispatchParticles(*kernels_.tiled_correct_velocity, substep);
    }
    if (kernels_.tiled_place_pins == nullptr) return;
    DispatchElements(*kernels_.tiled_place_pins, substep, largest_.pins);
  }

  // One sweep over the velocities that the links or joints forbid.
  void SolveVelocity(uint32_t substep, uint32_t sweep, bool is_of_joints,
                     const std::vector<uint32_t>& colours) {
    const gl::Program& kernel = *kernels_.tiled_solve_velocity;
    kernel.SetUniform(DRAPE_UNIFORM_SWEEP, sweep);
    kernel.SetUniform(DRAPE_UNIFORM_IS_OF_JOINTS, is_of_joints ? 1 : 0);
    for (uint32_t colour = 0; colour < colours.size(); ++colour) {
      kernel.SetUniform(DRAPE_UNIFORM_COLOUR, colour);
      DispatchElements(kernel, substep, colours[colour]);
    }
  }

  const StepKernels& kernels_;
  const uint32_t first_item_;
  const uint32_t item_count_;
  const LargestSizes largest_;
  const uint32_t phase_count_;   // of strips that are solved
  const uint32_t colour_count_;  // that are solved
  gl::Buffer& dispatches_;
  uint32_t dispatch_count_ = 0;
};

}  // namespace

void DeviceBarrier() {
  glMemoryBarrier(GL_SHADER_STORAGE_BARRIER_BIT | GL_COMMAND_BARRIER_BIT |
                  GL_BUFFER_UPDATE_BARRIER_BIT);
}

uint64_t MostDispatchesOfSweep(const SceneModel& model) {
  const uint64_t most =
      uint64_t{model.strips().phase_count()} + model.colour_count() + model.joint_colour_count();
  // Three cloths may have the most of one kind each. The refinement, contacts, the end of the
  // sweep.
  return 3 * most + 5;
}

uint32_t DispatchPerItem(const gl::Program& kernel, uint32_t first_item, uint32_t item_count,
                         const DispatchLimits& limits) {
  kernel.Use();
  uint32_t dispatch_count = 0;
  for (uint32_t done = 0; done < item_count; ++dispatch_count) {
    const uint32_t count = std::min(item_count - done, limits.group_count_x);
    kernel.SetUniform(DRAPE_UNIFORM_FIRST_ITEM, first_item + done);
    glDispatchCompute(count, 1, 1);
    done += count;
  }
  DeviceBarrier();
  return dispatch_count;
}

uint32_t StepResident(const StepGroup& group, const DispatchLimits& limits) {
  uint64_t part_count = 1;
  for (const GlCloth* cloth : group.cloths) part_count = std::max(part_count, cloth->part_count);
  uint32_t dispatch_count = 0;
  for (uint64_t part = 0; part < part_count; ++part) {
    group.kernels->resident_step->SetUniform(DRAPE_UNIFORM_PART, part == 0 ? 0 : 1);
    dispatch_count += DispatchPerItem(*group.kernels->resident_step, group.first_item,
                                      static_cast<uint32_t>(group.cloths.size()), limits);
  }
  return dispatch_count;
}

uint32_t Measure(const MeasureKernels& kernels, uint32_t first_item,
                 std::span<const GlCloth* const> cloths, const DispatchLimits& limits) {
  if (cloths.empty()) return 0;
  uint32_t largest_piece_count = 1;
  for (const GlCloth* cloth : cloths) {
    largest_piece_count = std::max(largest_piece_count, MeasurePieceCount(*cloth->model->model));
  }
  uint32_t dispatch_count = 0;
  const uint32_t item_count = static_cast<uint32_t>(cloths.size());
  kernels.pieces->Use();
  for (uint32_t done = 0; done < item_count; ++dispatch_count) {
    const uint32_t count = std::min(item_count - done, limits.group_count_y);
    kernels.pieces->SetUniform(DRAPE_UNIFORM_FIRST_ITEM, first_item + done);
    glDispatchCompute(largest_piece_count, count, 1);
    done += count;
  }
  DeviceBarrier();
  if (largest_piece_count == 1) return dispatch_count;
  return dispatch_count + DispatchPerItem(*kernels.total, first_item, item_count, limits);
}

uint32_t StepTiled(const StepGroup& group, const DispatchLimits& limits, gl::Buffer& dispatches) {
  uint32_t dispatch_count = 0;
  const std::span<const GlCloth* const> cloths(group.cloths);
  for (size_t first = 0; first < cloths.size(); first += limits.group_count_y) {
    const size_t count = std::min<size_t>(cloths.size() - first, limits.group_count_y);
    dispatch_count += TiledStep(*group.kernels, group.first_item + static_cast<uint32_t>(first),
                                cloths.subspan(first, count), dispatches)
                          .Run();
  }
  return dispatch_count;
}

}  // namespace drape
