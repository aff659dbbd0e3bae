#include "server/solver/gl_compute/kernel_costs.h"

#include <algorithm>
#include <bit>

#include "server/core/check.h"
#include "server/solver/energy_watch.h"
#include "server/solver/gl_compute/local_sizes.h"
#include "server/solver/gl_compute/strip_lanes.h"
#include "server/solver/solver_constants.h"
#include "server/solver/strain_bins.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint64_t RoundsFor(uint64_t elements, uint64_t local_size) {
  return (elements + local_size - 1) / local_size;
}

// Cost of a loop in addition to its rounds. Its condition is tested once more than its body runs,
// and llvmpipe was seen to count up to one pass more (found by letting kernels run until they were
// cut off: tests/gl_compute/kernel_loops_test.cpp).
constexpr uint64_t kLoopEnd = 2;

uint64_t LoopPasses(uint64_t elements, uint64_t local_size) {
  return RoundsFor(elements, local_size) + kLoopEnd;
}

// Most entries of one particle in a list that has those of particle p from offsets[p] to
// offsets[p + 1].
uint64_t LargestDegree(std::span<const uint32_t> offsets) {
  uint64_t largest = 0;
  for (size_t i = 0; i + 1 < offsets.size(); ++i) {
    largest = std::max<uint64_t>(largest, offsets[i + 1] - offsets[i]);
  }
  return largest;
}

uint64_t LargestSpringDegree(const SceneModel& model) {
  return model.spring_count() == 0 ? 0 : LargestDegree(model.spring_offsets());
}

// Invocations run in vectors, so each round takes as long as its particle with the most springs.
uint64_t SpringPasses(const SceneModel& model, uint64_t rounds) {
  return kLoopEnd * rounds +
         std::min<uint64_t>(rounds * LargestSpringDegree(model), 2 * model.spring_count());
}

// One sweep over the colours of constraints or joints.
uint64_t ColourPasses(std::span<const uint32_t> offsets, uint32_t local_size) {
  uint64_t passes = offsets.size() - 1 + kLoopEnd;
  for (size_t c = 0; c + 1 < offsets.size(); ++c) {
    passes += LoopPasses(offsets[c + 1] - offsets[c], local_size);
  }
  return passes;
}

// `sweeps` sweeps over the colours of the constraints.
uint64_t RepeatedColourPasses(const SceneModel& model, uint64_t sweeps, uint32_t local_size) {
  return sweeps + kLoopEnd + sweeps * ColourPasses(model.colour_offsets(), local_size);
}

// Clearing the flags of particles whose links are refined.
uint64_t ClearPasses(const SceneModel& model, uint32_t local_size) {
  return LoopPasses(RoundsFor(model.particle_count(), 32), local_size);
}

// Refining every link in `rounds` rounds: the flags, the tests, the sweeps.
uint64_t RefinePasses(const SceneModel& model, uint64_t rounds, uint32_t local_size) {
  const uint64_t of_round = ClearPasses(model, local_size) +
                            LoopPasses(model.constraint_count(), local_size) +
                            RepeatedColourPasses(model, kRefineSweeps, local_size);
  return rounds * (1 + of_round) + kLoopEnd;
}

// One strip: elimination, then at most two rounds over the impulses.
uint64_t PassesOfStrip(uint64_t links) {
  return links + kLoopEnd + 2 * (1 + links + kLoopEnd) + kLoopEnd;
}

// One sweep over the strips by elimination; each round takes as long as its longest strip.
uint64_t EliminationPasses(const StripSet& strips, uint32_t local_size) {
  uint64_t passes = strips.phase_count() + kLoopEnd;
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    const uint32_t end = strips.phase_offsets[phase + 1];
    for (uint32_t round = strips.phase_offsets[phase]; round < end; round += local_size) {
      uint64_t longest = 0;
      for (uint32_t s = round; s < std::min(round + local_size, end); ++s) {
        longest =
            std::max<uint64_t>(longest, strips.strip_offsets[s + 1] - strips.strip_offsets[s]);
      }
      passes += 1 + PassesOfStrip(longest);
    }
    passes += kLoopEnd;
  }
  return passes;
}

// One sweep over the strips from both ends (shaders/stages/meet_strips.glsl): each invocation looks
// for pins in words of 32 rows, takes part in the levels of the reduction, goes through half of a
// strip and back, and through a strip where a particle moves too far.
uint64_t BothEndsPasses(const StripSet& strips) {
  const uint64_t longest = LongestStrip(strips) + kLoopEnd;
  constexpr uint64_t kMostLevels = std::bit_width(kMaxStripLinks);
  const uint64_t pins = longest / 32 + kLoopEnd;
  return strips.phase_count() * (kMostLevels + 4 * pins + 3 * longest + 1) + kLoopEnd;
}

constexpr uint64_t kLaneGroups = DRAPE_SHARED_LANES / DRAPE_STRIP_LANES;

// One sweep over the strips by reduction: each round has a loop over the levels, three over groups
// of lanes that share memory, and one over the lanes where a particle moves too far.
uint64_t ReductionPasses(const SceneModel& model, uint32_t lane_count) {
  constexpr uint64_t kRound =
      1 + DRAPE_STRIP_LANE_LEVELS + 3 * kLaneGroups + DRAPE_STRIP_LANES + 5 * kLoopEnd;
  uint64_t passes = model.strips().phase_count() + kLoopEnd;
  for (const uint32_t lanes : CountStripLanes(model)) {
    passes += RoundsFor(lanes, lane_count) * kRound + kLoopEnd;
  }
  return passes;
}

// A kernel made for reduction eliminates if its invocations turn out to fill no subgroups.
uint64_t StripPasses(const SceneModel& model, uint32_t local_size, StripSolve strip_solve) {
  const StripSet& strips = model.strips();
  const uint64_t elimination = EliminationPasses(strips, local_size);
  if (strip_solve == StripSolve::kElimination) return elimination;
  if (strip_solve == StripSolve::kFromBothEnds) return BothEndsPasses(strips);
  return std::max(elimination, ReductionPasses(model, LaneCount(strip_solve, local_size)));
}

// A line of elastic elements: forwards and back.
uint64_t PassesOfLine(uint64_t particles) {
  return 2 * (particles + kLoopEnd);
}

// All families; each round takes as long as its longest line.
uint64_t ElasticLinePasses(const SceneModel& model, uint32_t local_size) {
  const ElasticLines& lines = model.elastic_lines();
  uint64_t passes = lines.families.size() + kLoopEnd;
  for (const ElasticFamily& family : lines.families) {
    if (family.kind == ElasticKind::kCells)
      passes += LoopPasses(model.particle_count(), local_size);
    for (uint32_t round = family.line_begin; round < family.line_end; round += local_size) {
      uint32_t longest = 0;
      for (uint32_t k = round; k < std::min(round + local_size, family.line_end); ++k) {
        longest = std::max(longest, lines.lines[k].count);
      }
      passes += 1 + PassesOfLine(longest);
    }
    passes += kLoopEnd;
  }
  return passes;
}

// The watch of energy: its sums, over particles and pins and, where something stores energy, again
// over links, joints and elements. 0 for a cloth that is not watched.
uint64_t EnergyWatchPasses(const PlannedCloth& cloth, uint32_t local_size, uint64_t sums) {
  const SceneModel& model = cloth.model;
  if (!EnergyLimitOf(model, cloth.parameters, cloth.lengths, cloth.plan).is_watched) return 0;
  const uint64_t rounds = RoundsFor(sums, local_size);
  const uint64_t total = kLoopEnd + sums + kLoopEnd;
  uint64_t passes = rounds * (1 + LoopPasses(model.particle_count(), sums) +
                              LoopPasses(model.pin_count() + cloth.parameters.max_grips, sums)) +
                    total;
  if (model.has_compliance() || model.has_joint_compliance() || model.elastic_count() > 0) {
    passes +=
        rounds * (1 + LoopPasses(model.constraint_count(), sums) +
                  LoopPasses(model.joint_count(), sums) + LoopPasses(model.elastic_count(), sums)) +
        total;
  }
  return passes;
}

// The passes that each stage makes in `resident_step`.
class StageCosts {
 public:
  StageCosts(const PlannedCloth& cloth, uint32_t local_size, StripSolve strip_solve)
      : cloth_(cloth),
        model_(cloth.model),
        local_size_(local_size),
        strip_solve_(strip_solve),
        rounds_(RoundsFor(model_.particle_count(), local_size)),
        particles_(rounds_ + kLoopEnd),
        colliders_(rounds_ * (cloth.parameters.colliders.size() + kLoopEnd)) {}

  LoopCosts operator()(StepStage stage) const {
    switch (stage) {
      case StepStage::kApplySprings:
        return OfKick(Springs());
      case StepStage::kApplyElastic:
        return OfKick(Elastic());
      case StepStage::kApplyWind:
        return OfKick(Air());
      case StepStage::kPredict:
        return {.substep = Predict()};
      case StepStage::kSolveElastic:
        return {.substep = ElasticLinePasses(model_, local_size_)};
      case StepStage::kSolveHinges:
        return {.substep = kLoopEnd + cloth_.plan.solver.hinge_stages * (1 + Elastic())};
      case StepStage::kDampTwist:
        return {.substep = 2 * particles_};
      case StepStage::kTether:
        return {.substep = particles_ + rounds_ * (kMaxTethersPerParticle + kLoopEnd)};
      case StepStage::kSolveStrips:
        // Before the first substep lanes look for pins, in two phases at most.
        return {.sweep = StripPasses(model_, local_size_, strip_solve_),
                .fixed = IsReduction(strip_solve_) ? 2 * (kLaneGroups + kLoopEnd) : 0};
      case StepStage::kRefine:
        return {.fixed = RefinePasses(model_, cloth_.plan.solver.refine_rounds, local_size_)};
      case StepStage::kSolveDistance:
        return {.sweep = Links()};
      case StepStage::kSolveJoints:
        return {.sweep = Joints()};
      case StepStage::kSolveContacts:
        return {.sweep = 1 + particles_ + colliders_, .fixed = Reach()};
      case StepStage::kIntegrate:
        return {.substep = particles_ + Pins()};
      case StepStage::kSolveVelocity:
        return {.substep = particles_ + kLoopEnd +
                           cloth_.plan.solver.velocity_iterations * (1 + Links() + Joints())};
      case StepStage::kCorrectVelocity:
        // The violation and the velocity of each contact, both in the loop of `integrate`.
        return {.substep = cloth_.plan.Has(StepStage::kSolveContacts) ? 2 * colliders_ : 0};
      case StepStage::kCommit:
        // Loading, checking with its loop over the axes, storing, pausing.
        return {.fixed = 4 * particles_ + 4 * rounds_ + 8 +
                         EnergyWatchPasses(cloth_, local_size_, DRAPE_RESIDENT_ENERGY_SUMS)};
      case StepStage::kMeasure:
        break;  // a kernel of its own
      case StepStage::kFindSelfContacts:
      case StepStage::kSolveSelfContacts:
      case StepStage::kGuardSelfContacts:
        break;  // kernels of their own
    }
    return {};
  }

 private:
  // In each substep, and once before the first.
  static LoopCosts OfKick(uint64_t passes) { return {.substep = passes, .fixed = passes}; }

  uint64_t Springs() const { return 2 * particles_ + SpringPasses(model_, rounds_); }

  uint64_t Elastic() const {
    const ElasticShares& shares = model_.elastic_shares();
    const uint64_t of_particles = rounds_ * LargestDegree(shares.offsets);
    return LoopPasses(model_.elastic_count(), local_size_) + (1 + kLoopEnd) * rounds_ + kLoopEnd +
           std::min<uint64_t>(of_particles, shares.ends.size());
  }

  uint64_t Air() const {
    const uint64_t triangles = model_.triangles().size();
    const uint64_t of_particles = rounds_ * LargestDegree(model_.triangle_offsets());
    return LoopPasses(triangles, local_size_) + (1 + kLoopEnd) * rounds_ + kLoopEnd +
           std::min<uint64_t>(of_particles, 3 * triangles);
  }

  uint64_t Predict() const {
    return particles_ + Pins() + (cloth_.plan.solver.has_spring_forces ? Springs() : 0) +
           (HasRestitution(cloth_.parameters) ? colliders_ : 0) +
           (cloth_.plan.solver.has_quiet_links ? colliders_ : 0);
  }

  // Finding the colliders that the cloth can meet: three loops over the words of the range, one to
  // read them, particles, pins, and colliders, each along a few directions.
  uint64_t Reach() const {
    const uint64_t tested =
        std::min<uint64_t>(cloth_.parameters.colliders.size(), DRAPE_LEFT_OUT_COLLIDERS);
    return 4 * (DRAPE_RANGE_WORDS + kLoopEnd) + particles_ + Pins() +
           RoundsFor(tested, local_size_) * (1 + kReachDirections + kLoopEnd) + kLoopEnd;
  }

  uint64_t Pins() const {
    return LoopPasses(model_.pin_count() + cloth_.parameters.max_grips, local_size_);
  }
  uint64_t Links() const { return ColourPasses(model_.colour_offsets(), local_size_); }
  uint64_t Joints() const { return ColourPasses(model_.joint_colour_offsets(), local_size_); }

  const PlannedCloth& cloth_;
  const SceneModel& model_;
  const uint32_t local_size_;
  const StripSolve strip_solve_;
  const uint64_t rounds_;     // over the particles
  const uint64_t particles_;  // a loop over the particles
  const uint64_t colliders_;  // loops over the colliders in one over the particles
};

}  // namespace

uint64_t CountTiledRefineLoops(const SceneModel& model, uint32_t local_size) {
  // Its sweeps, one more over the same links to clear their flags, then the counts.
  return RepeatedColourPasses(model, kRefineSweeps, local_size) +
         ColourPasses(model.colour_offsets(), local_size) + model.colour_count() + kLoopEnd;
}

uint64_t LongestStrip(const StripSet& strips) {
  uint64_t longest = 0;
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    longest = std::max<uint64_t>(longest, strips.strip_offsets[s + 1] - strips.strip_offsets[s]);
  }
  return longest;
}

LoopCosts CountResidentLoops(const PlannedCloth& cloth, uint32_t local_size,
                             StripSolve strip_solve) {
  const StageCosts costs_of(cloth, local_size, strip_solve);
  // A pass of the loop over the sweeps; four for the loops over kicks, substeps and sweeps.
  LoopCosts costs{.sweep = 1, .substep = 4, .fixed = 0};
  for (size_t k = 0; k < kStageNames.size(); ++k) {
    const auto stage = static_cast<StepStage>(k);
    if (!cloth.plan.Has(stage)) continue;
    const LoopCosts of_stage = costs_of(stage);
    costs.sweep += of_stage.sweep;
    costs.substep += of_stage.substep;
    costs.fixed += of_stage.fixed;
  }
  return costs;
}

uint64_t CountContactWalk(const SceneModel& model, uint32_t local_size) {
  // Nodes of the tree and primitives of the patches around each vertex and each edge, of which
  // there are half as many again as triangles.
  constexpr uint64_t kPassesOfWalk = 150;
  const uint64_t sources = model.particle_count() + 3 * model.triangles().size() / 2;
  return kPassesOfWalk * RoundsFor(sources, local_size);
}

bool CanRunInParts(const LoopCosts& costs, uint64_t budget) {
  return costs.fixed + 3 * (costs.substep + costs.sweep) <= budget;
}

uint64_t CountParts(const LoopCosts& costs, uint64_t substeps, uint64_t max_iterations,
                    uint64_t budget) {
  DRAPE_CHECK(CanRunInParts(costs, budget), "the budget of a dispatch is too small for this cloth");
  const uint64_t total = substeps * (costs.substep + max_iterations * costs.sweep);
  if (costs.fixed + total <= budget) return 1;
  // A part leaves less than a substep and a sweep unused, and counts the substep that it continues
  // with again.
  const uint64_t useful = budget - costs.fixed - 2 * (costs.substep + costs.sweep);
  return RoundsFor(total, useful);
}

uint64_t CountLongestLoop(const PlannedCloth& cloth, uint32_t local_size,
                          uint32_t measure_local_size) {
  const SceneModel& model = cloth.model;
  const uint64_t colliders = cloth.parameters.colliders.size();
  const uint64_t piece_rounds = RoundsFor(DRAPE_MEASURE_PIECE, measure_local_size);
  const uint64_t measure = 4 * (piece_rounds + 1) + piece_rounds * (colliders + kLoopEnd) +
                           SpringPasses(model, piece_rounds) + 16;
  // `measure_strains`: clearing the bins, the links, sums over the bins and over invocations,
  // search.
  const uint64_t strains = 3 * LoopPasses(kStrainBins, kStrainsLocalSize) +
                           LoopPasses(model.constraint_count(), kStrainsLocalSize) +
                           kStrainsLocalSize + kLoopEnd;
  const uint64_t air =
      cloth.plan.Has(StepStage::kApplyWind) ? LargestDegree(model.triangle_offsets()) + 1 : 0;
  const uint64_t elastic =
      model.elastic_count() > 0 ? LargestDegree(model.elastic_shares().offsets) + 1 : 0;
  const uint64_t strip = PassesOfStrip(LongestStrip(model.strips()));
  uint64_t line = 0;
  if (cloth.plan.Has(StepStage::kSolveElastic)) {
    for (const ElasticLine& of_model : model.elastic_lines().lines) {
      line = std::max(line, PassesOfLine(of_model.count));
    }
  }
  // To find the colour of a link, to refine it.
  const uint64_t colour = uint64_t{model.colour_count()} + kLoopEnd;
  const uint64_t tiled =
      std::max({strip, line, LargestSpringDegree(model) + 1, elastic, air, colour,
                2 * (colliders + 1), uint64_t{kMaxTethersPerParticle} + 1});
  // `tiled_begin_sweeps` and `tiled_end_sweep` loop over the dispatches of all phases and colours,
  // the three of the refinement, both kinds of contacts and the end of the sweep.
  const uint64_t control = LoopPasses(uint64_t{model.strips().phase_count()} +
                                          model.colour_count() + model.joint_colour_count() + 6,
                                      local_size);
  const uint64_t watch = EnergyWatchPasses(cloth, local_size, DRAPE_TILED_ENERGY_SUMS);
  return std::max({measure, strains, tiled, control, watch});
}

}  // namespace drape
