#include "server/solver/gl_compute/kernel_costs.h"
#include "server/solver/gl_compute/plan_on_device.h"

#include <algorithm>
#include <bit>

#include "server/core/check.h"
#include "server/solver/solver_constants.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint64_t RoundsFor(uint64_t elements, uint64_t local_size) {
  return (elements + local_size - 1) / local_size;
}

// What a loop costs beside its rounds. Its condition is tested once more than its body is run, and
// llvmpipe was seen to book up to one more (found by letting kernels run until they were cut:
// tests/gl_compute/kernel_loops_test.cpp).
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

// Of one sweep over the colours of constraints or joints.
uint64_t ColourPasses(std::span<const uint32_t> offsets, uint32_t local_size) {
  uint64_t passes = offsets.size() - 1 + kLoopEnd;
  for (size_t c = 0; c + 1 < offsets.size(); ++c) {
    passes += LoopPasses(offsets[c + 1] - offsets[c], local_size);
  }
  return passes;
}

// Of `sweeps` sweeps over the colours of the constraints.
uint64_t RepeatedColourPasses(const SceneModel& model, uint64_t sweeps, uint32_t local_size) {
  return sweeps + kLoopEnd + sweeps * ColourPasses(model.colour_offsets(), local_size);
}

// Of clearing the flags of particles whose links are far off.
uint64_t ClearPasses(const SceneModel& model, uint32_t local_size) {
  return LoopPasses(RoundsFor(model.particle_count(), 32), local_size);
}

// Of the refinement of every link in `rounds` rounds: the flags, the tests, the sweeps.
uint64_t RefinePasses(const SceneModel& model, uint64_t rounds, uint32_t local_size) {
  const uint64_t of_round = ClearPasses(model, local_size) +
                            LoopPasses(model.constraint_count(), local_size) +
                            RepeatedColourPasses(model, kRefineSweeps, local_size);
  return rounds * (1 + of_round) + kLoopEnd;
}

// Of one strip: elimination, then at most two rounds over the impulses.
uint64_t PassesOfStrip(uint64_t links) {
  return links + kLoopEnd + 2 * (1 + links + kLoopEnd) + kLoopEnd;
}

// Of one sweep over the strips by elimination; each round takes as long as its longest strip.
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

// Of one sweep over the strips by reduction: rounds of as many strips as there are groups of lanes,
// each with a loop over the levels and one over those of the maximum.
uint64_t ReductionPasses(const StripSet& strips, uint32_t lane_count) {
  constexpr uint64_t kLevels = std::bit_width(DRAPE_STRIP_LANES - 1);
  const uint64_t groups = lane_count / DRAPE_STRIP_LANES;
  uint64_t passes = strips.phase_count() + kLoopEnd;
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    const uint64_t strips_of_phase = strips.phase_offsets[phase + 1] - strips.phase_offsets[phase];
    passes += RoundsFor(strips_of_phase, groups) * (1 + 2 * (kLevels + kLoopEnd)) + kLoopEnd;
  }
  return passes;
}

// Where the invocations turn out to fill no subgroups, a kernel made for reduction eliminates.
uint64_t StripPasses(const StripSet& strips, uint32_t local_size, StripSolve strip_solve) {
  const uint64_t elimination = EliminationPasses(strips, local_size);
  if (strip_solve == StripSolve::kElimination) return elimination;
  const bool has_subgroups = strip_solve == StripSolve::kReduction;
  const uint32_t lane_count = has_subgroups ? local_size : std::min(local_size, DRAPE_SHARED_LANES);
  return std::max(elimination, ReductionPasses(strips, lane_count));
}

// Of one kick of the air.
uint64_t AirPasses(const SceneModel& model, uint64_t rounds, uint32_t local_size) {
  const uint64_t triangles = model.triangles().size();
  const uint64_t of_particles = rounds * LargestDegree(model.triangle_offsets());
  return LoopPasses(triangles, local_size) + (1 + kLoopEnd) * rounds + kLoopEnd +
         std::min<uint64_t>(of_particles, 3 * triangles);
}

// Of one kick of the elastic elements.
uint64_t ElasticPasses(const SceneModel& model, uint64_t rounds, uint32_t local_size) {
  if (model.elastic_count() == 0) return 0;
  const ElasticShares& shares = model.elastic_shares();
  const uint64_t of_particles = rounds * LargestDegree(shares.offsets);
  return LoopPasses(model.elastic_count(), local_size) + (1 + kLoopEnd) * rounds + kLoopEnd +
         std::min<uint64_t>(of_particles, shares.ends.size());
}

// Of finding the colliders that the cloth can meet: three loops over the words of the range, one to
// read them, particles, pins, and colliders, each along a few directions.
uint64_t ReachPasses(const SceneModel& model, uint64_t colliders, uint32_t local_size) {
  const uint64_t tested = std::min<uint64_t>(colliders, DRAPE_LEFT_OUT_COLLIDERS);
  return 4 * (DRAPE_RANGE_WORDS + kLoopEnd) + LoopPasses(model.particle_count(), local_size) +
         LoopPasses(model.pin_count(), local_size) +
         RoundsFor(tested, local_size) * (1 + kReachDirections + kLoopEnd) + kLoopEnd;
}

}  // namespace

uint64_t CountTiledRefineLoops(const SceneModel& model, uint32_t local_size) {
  // Its sweeps, and one more over what it has solved to clear the flags; then the counts.
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

bool IsReductionShorter(const StripSet& strips, uint32_t local_size) {
  return ReductionPasses(strips, local_size) < EliminationPasses(strips, local_size);
}

LoopCosts CountResidentLoops(const SceneModel& model, const ClothParameters& parameters,
                             uint32_t local_size, bool has_own_lengths, StripSolve strip_solve) {
  const SolverChoice solver = PlanOnDevice(model, parameters, has_own_lengths).solver;
  const uint64_t rounds = RoundsFor(model.particle_count(), local_size);
  const uint64_t particles = rounds + kLoopEnd;
  const uint64_t colliders = parameters.colliders.size();
  const bool has_springs = model.spring_count() > 0;
  const uint64_t springs = has_springs ? 2 * particles + SpringPasses(model, rounds) : 0;

  const uint64_t elastic = ElasticPasses(model, rounds, local_size);
  const uint64_t air = HasAirForces(model, parameters) ? AirPasses(model, rounds, local_size) : 0;

  LoopCosts costs;
  costs.sweep = 1;
  if (solver.has_strips) costs.sweep += StripPasses(model.strips(), local_size, strip_solve);
  if (!solver.has_strips) costs.sweep += ColourPasses(model.colour_offsets(), local_size);
  if (model.joint_count() > 0) {
    costs.sweep += ColourPasses(model.joint_colour_offsets(), local_size);
  }
  if (colliders > 0) costs.sweep += 1 + particles + rounds * (colliders + kLoopEnd);
  costs.substep =
      4 + springs + elastic + air + 2 * particles + 2 * LoopPasses(model.pin_count(), local_size);
  if (solver.velocity_iterations > 0) {
    const uint64_t colours = ColourPasses(model.colour_offsets(), local_size) +
                             ColourPasses(model.joint_colour_offsets(), local_size);
    costs.substep += particles + kLoopEnd + solver.velocity_iterations * (1 + colours);
  }
  if (HasTwistDamping(model, parameters.settings)) costs.substep += 2 * particles;
  if (HasTethers(model, parameters.settings)) {
    costs.substep += particles + rounds * (kMaxTethersPerParticle + kLoopEnd);
  }
  if (colliders > 0) costs.substep += 2 * rounds * (colliders + kLoopEnd);
  if (HasRestitution(parameters)) costs.substep += rounds * (colliders + kLoopEnd);
  // Loading, checking with its loop over the axes, storing, pausing.
  costs.fixed = springs + elastic + air + 4 * particles + 4 * rounds + 8;
  if (colliders > 0) costs.fixed += ReachPasses(model, colliders, local_size);
  if (solver.refine_rounds > 0) {
    costs.fixed += RefinePasses(model, solver.refine_rounds, local_size);
  }
  return costs;
}

bool CanRunInParts(const LoopCosts& costs, uint64_t budget) {
  return costs.fixed + 3 * (costs.substep + costs.sweep) <= budget;
}

uint64_t CountParts(const LoopCosts& costs, const StepSettings& settings, uint64_t budget) {
  DRAPE_CHECK(CanRunInParts(costs, budget), "the budget of a dispatch is too small for this cloth");
  // With two steps there is one substep more.
  const uint64_t total =
      (uint64_t{settings.substeps} + 1) * (costs.substep + settings.max_iterations * costs.sweep);
  if (costs.fixed + total <= budget) return 1;
  // A part leaves less than a substep and a sweep unused, and books the substep it goes on with
  // again.
  const uint64_t useful = budget - costs.fixed - 2 * (costs.substep + costs.sweep);
  return RoundsFor(total, useful);
}

uint64_t CountLongestLoop(const SceneModel& model, const ClothParameters& parameters,
                          uint32_t local_size, uint32_t measure_local_size) {
  const uint64_t colliders = parameters.colliders.size();
  const uint64_t piece_rounds = RoundsFor(DRAPE_MEASURE_PIECE, measure_local_size);
  const uint64_t measure = 4 * (piece_rounds + 1) + piece_rounds * (colliders + kLoopEnd) +
                           SpringPasses(model, piece_rounds) + 16;
  const uint64_t air =
      HasAirForces(model, parameters) ? LargestDegree(model.triangle_offsets()) + 1 : 0;
  const uint64_t elastic =
      model.elastic_count() > 0 ? LargestDegree(model.elastic_shares().offsets) + 1 : 0;
  const uint64_t strip = PassesOfStrip(LongestStrip(model.strips()));
  // To find the colour of a link, to refine it.
  const uint64_t colour = uint64_t{model.colour_count()} + kLoopEnd;
  const uint64_t tiled = std::max({strip, LargestSpringDegree(model) + 1, elastic, air, colour,
                                   2 * (colliders + 1), uint64_t{kMaxTethersPerParticle} + 1});
  // `tiled_begin_sweeps` and `tiled_end_sweep` go through the dispatches of all phases and colours,
  // the three of the refinement, the contacts and the end of the sweep.
  const uint64_t control = LoopPasses(uint64_t{model.strips().phase_count()} +
                                          model.colour_count() + model.joint_colour_count() + 5,
                                      local_size);
  return std::max({measure, tiled, control});
}

}  // namespace drape
