#include "server/solver/gl_compute/largest_sizes.h"

#include <algorithm>

namespace drape {

namespace {

void Enlarge(uint32_t size, uint32_t& largest) {
  largest = std::max(largest, size);
}

void Enlarge(const std::vector<uint32_t>& sizes, std::vector<uint32_t>& largest) {
  if (largest.size() < sizes.size()) largest.resize(sizes.size());
  for (size_t c = 0; c < sizes.size(); ++c) Enlarge(sizes[c], largest[c]);
}

void AddSubsteps(const SubstepSchedule& schedule, std::vector<SubstepWork>& substeps) {
  if (substeps.size() < schedule.size()) substeps.resize(schedule.size());
  for (uint32_t index = 0; index < schedule.size(); ++index) {
    const Substep substep = schedule[index];
    SubstepWork& work = substeps[index];
    work.kicks_before |= substep.kick_before_s > 0;
    work.kicks_within |= substep.kick_within_s > 0;
    work.kicks_after |= substep.kick_after_s > 0;
    work.damps_twist |= substep.twist_share > 0;
    work.is_last |= index + 1 == schedule.size();
  }
}

void AddFamilies(const ElasticLines& lines, std::vector<ElasticWork>& families) {
  if (families.size() < lines.families.size()) families.resize(lines.families.size());
  for (size_t k = 0; k < lines.families.size(); ++k) {
    const ElasticFamily& family = lines.families[k];
    Enlarge(family.line_end - family.line_begin, families[k].lines);
    families[k].has_cells |= family.kind == ElasticKind::kCells;
  }
}

}  // namespace

LargestSizes FindLargest(std::span<const GlCloth* const> cloths) {
  LargestSizes largest;
  for (const GlCloth* cloth : cloths) {
    const SceneModel& model = *cloth->model->model;
    const StepPlan& plan = cloth->plan;
    Enlarge(model.particle_count(), largest.particles);
    Enlarge(model.pin_count() + cloth->parameters.max_grips, largest.pins);
    Enlarge(static_cast<uint32_t>(model.triangles().size()), largest.triangles);
    Enlarge(model.elastic_count(), largest.elastic_elements);
    Enlarge(model.constraint_count(), largest.constraints);
    Enlarge(cloth->max_iterations, largest.max_iterations);
    Enlarge(plan.solver.velocity_iterations, largest.velocity_iterations);
    Enlarge(plan.solver.hinge_stages, largest.hinge_stages);
    AddSubsteps(plan.schedule, largest.substeps);
    AddFamilies(model.elastic_lines(), largest.elastic_families);
    if (plan.Has(StepStage::kRefine)) {
      const std::pair last{plan.schedule.size() - 1, cloth->max_iterations - 1};
      Enlarge(plan.solver.refine_rounds, largest.refine_rounds[last]);
    }
    Enlarge(cloth->model->phase_sizes, largest.phases);
    Enlarge(cloth->model->phase_blocks, largest.phase_blocks);
    Enlarge(cloth->model->colour_sizes, largest.colours);
    Enlarge(cloth->model->joint_colour_sizes, largest.joint_colours);
  }
  return largest;
}

}  // namespace drape
