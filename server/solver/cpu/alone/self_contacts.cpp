#include "server/solver/cpu/alone/self_contacts.h"

#include <algorithm>

#include "server/solver/solver_constants.h"

namespace drape::cpu {
namespace {

SelfContactMemory& MemoryOf(SteppedCloths cloths) {
  return *cloths[0].context.scratch.self_contacts;
}

bool AreAskedForImpulses(SteppedCloths cloths) {
  return std::ranges::any_of(
      cloths, [](const SteppedCloth& cloth) { return cloth.context.asks_for_impulses; });
}

// function(cloth, first): of each cloth and its first particle in the world.
template <class Function>
void ForEach(SteppedCloths cloths, const Function& function) {
  size_t first = 0;
  for (const SteppedCloth& cloth : cloths) {
    function(cloth, first);
    first += cloth.context.model.particle_count;
  }
}

uint32_t ParticlesOf(SteppedCloths cloths) {
  uint32_t count = 0;
  for (const SteppedCloth& cloth : cloths) count += cloth.context.model.particle_count;
  return count;
}

// The vectors of all particles: those of one cloth where they are, those of several in `world`.
// `vectors_of(scratch)` of a cloth; `are_places`: in the frame of the cloth.
template <class VectorsOf>
std::span<Vec4> Gather(SteppedCloths cloths, bool are_places, const VectorsOf& vectors_of,
                       std::vector<Vec4>& world) {
  const uint32_t count = ParticlesOf(cloths);
  if (cloths.size() == 1) return std::span(vectors_of(cloths[0].context.scratch)).first(count);
  world.resize(count);
  ForEach(cloths, [&](const SteppedCloth& cloth, size_t first) {
    const Vec4* from = vectors_of(cloth.context.scratch).data();
    Vec4* const to = world.data() + first;
    const Vec4 origin = are_places ? cloth.context.world_origin : Vec4{};
    for (uint32_t i = 0; i < cloth.context.model.particle_count; ++i) to[i] = from[i] + origin;
  });
  return world;
}

// What contacts have changed goes back to the cloths; all else keeps its bits.
template <class VectorsOf>
void Scatter(SteppedCloths cloths, bool are_places, const VectorsOf& vectors_of,
             const std::vector<Vec4>& world) {
  if (cloths.size() == 1) return;
  ForEach(cloths, [&](const SteppedCloth& cloth, size_t first) {
    Vec4* const to = vectors_of(cloth.context.scratch).data();
    const Vec4* const from = world.data() + first;
    const Vec4 origin = are_places ? cloth.context.world_origin : Vec4{};
    for (uint32_t i = 0; i < cloth.context.model.particle_count; ++i) {
      const Vec4 before = to[i] + origin;
      if (IsAnyLaneSet(from[i] != before)) to[i] += from[i] - before;
    }
  });
}

std::vector<Vec4>& Positions(StepScratch& scratch) {
  return scratch.state.positions;
}
std::vector<Vec4>& Velocities(StepScratch& scratch) {
  return scratch.state.velocities;
}
std::vector<Vec4>& PreviousPositions(StepScratch& scratch) {
  return scratch.previous.positions;
}
std::vector<Vec4>& PreviousVelocities(StepScratch& scratch) {
  return scratch.previous.velocities;
}

std::span<const float> InverseMasses(SteppedCloths cloths, std::vector<float>& world) {
  if (cloths.size() == 1) return cloths[0].context.held.inverse_masses;
  world.clear();
  for (const SteppedCloth& cloth : cloths) {
    const std::span<const float> its = cloth.context.held.inverse_masses;
    world.insert(world.end(), its.begin(), its.begin() + cloth.context.model.particle_count);
  }
  return world;
}

// Of the cloth with the largest.
template <class NumberOf>
float Largest(SteppedCloths cloths, const NumberOf& number_of) {
  float largest = 0;
  for (const SteppedCloth& cloth : cloths) {
    largest = std::max(largest, number_of(cloth.context));
  }
  return largest;
}

// The mean over the particles; one cloth: its own.
float EdgeLength(SteppedCloths cloths) {
  if (cloths.size() == 1) return cloths[0].context.model.length_scale;
  float sum = 0;
  for (const SteppedCloth& cloth : cloths) {
    const FloatModel& model = cloth.context.model;
    sum += static_cast<float>(model.particle_count) * model.length_scale;
  }
  return sum / static_cast<float>(ParticlesOf(cloths));
}

void PrepareMemory(StepScratch& scratch) {
  if (scratch.self_contacts == nullptr) {
    scratch.self_contacts = std::make_shared<SelfContactMemory>();
  }
}

// Velocities before a stage of contacts, if somebody is to be told what that changes.
void Keep(SteppedCloths cloths, std::span<const Vec4> velocities, std::vector<Vec4>& before) {
  before.clear();
  const bool is_asked = std::ranges::any_of(
      cloths, [](const SteppedCloth& cloth) { return cloth.context.asks_for_contacts; });
  if (is_asked) before.assign(velocities.begin(), velocities.end());
}

// function(i, sums, impulse) of each free particle of cloths that ask: what its velocity has
// changed by, times its mass.
template <class Function>
void ForChanges(SteppedCloths cloths, std::span<const Vec4> after, const std::vector<Vec4>& before,
                const Function& function) {
  if (before.empty()) return;
  ForEach(cloths, [&](const SteppedCloth& cloth, size_t first) {
    const StepContext& context = cloth.context;
    if (!context.asks_for_contacts) return;
    for (const uint32_t i : context.held.free_particles) {
      const Vec4 change = after[first + i] - before[first + i];
      function(i, *context.impulses(), context.model.free_masses[i] * change);
    }
  });
}

// What the step needs to know, in the memory of the cloths.
self_contact::StepNumbers<Vec4> NumbersOf(SteppedCloths cloths) {
  SelfContactMemory& memory = MemoryOf(cloths);
  memory.pulls.clear();
  if (AreAskedForImpulses(cloths)) memory.pulls.resize(ParticlesOf(cloths));
  memory.pulls_in_memory = memory.pulls;
  memory.thicknesses.clear();
  memory.frictions.clear();
  for (const SteppedCloth& cloth : cloths) {
    const SelfContactNumbers& numbers = cloth.context.controls.contact;
    memory.thicknesses.push_back(static_cast<float>(numbers.thickness_m));
    memory.frictions.push_back({static_cast<float>(numbers.friction_static),
                                static_cast<float>(numbers.friction_dynamic)});
  }
  const FloatControls& controls = cloths[0].context.controls;
  return {.thicknesses = {std::ranges::max(memory.thicknesses), memory.thicknesses},
          .frictions = memory.frictions,
          .depenetration_speed = static_cast<float>(kMaxDepenetrationSpeed_m_per_s),
          .gravity = Largest(cloths, [](const auto& its) { return Length(its.controls.gravity); }),
          .slowest_landing =
              Largest(cloths, [](const auto& its) { return its.controls.slowest_landing; }),
          .grazing_sine = static_cast<float>(kGrazingSine),
          .touch_round_offs = static_cast<float>(kTouchRoundOffs),
          .edge_length = EdgeLength(cloths),
          .time_step = controls.time_step,
          .substeps = controls.plan.schedule.size(),
          .has_two_steps = controls.plan.solver.has_two_steps,
          .inverse_masses = InverseMasses(cloths, memory.world.inverse_masses),
          .pulls = {memory.pulls, memory.pulls_in_memory},
          .interruption = cloths[0].context.interruption};
}

// Positions at the start of the substep.
std::span<const Vec4> Starts(SteppedCloths cloths) {
  if (cloths.size() > 1) return MemoryOf(cloths).starts;
  const StepContext& context = cloths[0].context;
  const bool are_kept = context.substep.is_two_step;
  return are_kept ? context.scratch.previous.positions : MemoryOf(cloths).starts;
}

}  // namespace

bool MayTouch(SteppedCloths cloths) {
  return cloths[0].context.contact_surface != nullptr;
}

void BeginSelfContacts(SteppedCloths cloths) {
  if (!MayTouch(cloths)) return;
  const StepContext& first = cloths[0].context;
  PrepareMemory(first.scratch);
  SelfContactMemory& memory = MemoryOf(cloths);
  bool may_cross = false;
  for (const SteppedCloth& cloth : cloths) may_cross |= cloth.context.may_cross_itself;
  memory.contacts.Begin(*first.contact_surface, NumbersOf(cloths), may_cross,
                        Gather(cloths, true, Positions, memory.starts));
}

std::optional<ExpectedFlight> ExpectNoContacts(const StepContext& context,
                                               const FloatState& state) {
  PrepareMemory(context.scratch);
  FloatState unused;
  SteppedCloth cloth{context, false, unused};
  const uint32_t count = context.model.particle_count;
  const auto expected =
      MemoryOf({&cloth, 1})
          .contacts.ExpectNothing(*context.contact_surface, NumbersOf({&cloth, 1}),
                                  std::span(state.positions).first(count),
                                  std::span(state.velocities).first(count));
  if (!expected) return std::nullopt;
  return ExpectedFlight{expected->velocities, expected->drift, expected->substep_s};
}

bool FoundNoContacts(const StepScratch& scratch) {
  return scratch.self_contacts != nullptr && scratch.self_contacts->contacts.has_found_nothing();
}

bool StartsCrossing(SteppedCloths cloths, size_t index) {
  if (!MayTouch(cloths)) return false;
  const std::vector<bool>& is_crossing = MemoryOf(cloths).contacts.is_crossing();
  if (is_crossing.empty()) return false;
  const auto begin = is_crossing.begin() + ParticlesOf(cloths.first(index));
  const auto end = begin + cloths[index].context.model.particle_count;
  return std::find(begin, end, true) != end;
}

bool GaveContactsUp(SteppedCloths cloths) {
  return MayTouch(cloths) && MemoryOf(cloths).contacts.has_given_up();
}

void FindSelfContacts(SteppedCloths cloths) {
  if (!MayTouch(cloths)) return;
  SelfContactMemory& memory = MemoryOf(cloths);
  // With two steps the predicted state has replaced the one before, which `previous` holds.
  const bool are_kept = cloths[0].context.substep.is_two_step;
  if (!are_kept && cloths.size() == 1) memory.starts = cloths[0].context.scratch.state.positions;
  if (cloths.size() > 1) {
    Gather(cloths, true, are_kept ? PreviousPositions : Positions, memory.starts);
  }
  memory.contacts.Find(
      Starts(cloths),
      Gather(cloths, false, are_kept ? PreviousVelocities : Velocities, memory.world.velocities));
}

bool SolveSelfContacts(SteppedCloths cloths) {
  if (!MayTouch(cloths)) return false;
  SelfContactMemory& memory = MemoryOf(cloths);
  if (memory.contacts.active().empty()) return false;
  const float interval = cloths[0].context.substep.interval;
  float least_change = cloths[0].context.controls.contact_tolerance;
  for (const SteppedCloth& cloth : cloths) {
    least_change = std::min(least_change, cloth.context.controls.contact_tolerance);
  }
  const std::span<const Vec4> base = Gather(cloths, true, Positions, memory.world.base);
  const std::span<Vec4> u = Gather(cloths, false, Velocities, memory.world.velocities);
  Keep(cloths, u, memory.before);
  const bool has_changed = memory.contacts.Solve(Starts(cloths).data(), base.data(), u.data(),
                                                 interval, least_change / interval);
  ForChanges(cloths, u, memory.before,
             [](uint32_t i, ImpulseSums& sums, Vec4 impulse) { sums.PushByCloth(i, impulse); });
  Scatter(cloths, false, Velocities, memory.world.velocities);
  return has_changed;
}

uint32_t SweepsAfterHits(SteppedCloths cloths) {
  const uint32_t asked = cloths[0].context.max_iterations;
  return MayTouch(cloths) ? MemoryOf(cloths).contacts.SweepsOf(asked) : asked;
}

void GuardSelfContacts(SteppedCloths cloths) {
  if (!MayTouch(cloths)) return;
  SelfContactMemory& memory = MemoryOf(cloths);
  WorldVectors& world = memory.world;
  const StepContext& first = cloths[0].context;
  const bool is_two_step = first.substep.is_two_step;
  self_contact::PlanarGuard<Vec4>::Motion motion{
      .starts = Starts(cloths).first(ParticlesOf(cloths)),
      .ends = Gather(cloths, true, Positions, world.ends),
      .velocities = Gather(cloths, false, Velocities, world.velocities),
      .previous_velocities = {},
      .previous_positions = {},
      .inverse_masses = cloths.size() == 1 ? first.held.inverse_masses
                                           : std::span<const float>(world.inverse_masses),
      .duration = first.controls.h};
  if (is_two_step) {
    motion.previous_velocities =
        Gather(cloths, false, PreviousVelocities, world.previous_velocities);
    motion.previous_positions = Gather(cloths, true, PreviousPositions, world.previous_positions);
  }
  Keep(cloths, motion.velocities, memory.before);
  Keep(cloths, motion.previous_velocities, memory.before_previous);
  const bool has_failed = !memory.contacts.Guard(motion);
  ForChanges(cloths, motion.velocities, memory.before,
             [](uint32_t i, ImpulseSums& sums, Vec4 impulse) { sums.PushByCloth(i, impulse); });
  ForChanges(
      cloths, motion.previous_velocities, memory.before_previous,
      [](uint32_t i, ImpulseSums& sums, Vec4 impulse) { sums.PushByClothInMemory(i, -impulse); });
  Scatter(cloths, true, Positions, world.ends);
  Scatter(cloths, false, Velocities, world.velocities);
  if (is_two_step) {
    Scatter(cloths, false, PreviousVelocities, world.previous_velocities);
    Scatter(cloths, true, PreviousPositions, world.previous_positions);
  }
  ForEach(cloths, [&](const SteppedCloth& cloth, size_t particle) {
    cloth.context.scratch.self_contacts_failed |= has_failed;
    cloth.context.ForHeldAsked([&](uint32_t i, ImpulseSums& sums) {
      Vec4& pull = memory.pulls[particle + i];
      Vec4& pull_in_memory = memory.pulls_in_memory[particle + i];
      sums.Pull(i, pull);
      sums.PullInMemory(i, pull_in_memory);
      if (cloth.context.asks_for_contacts) {
        sums.PushByCloth(i, pull);
        sums.PushByClothInMemory(i, pull_in_memory);
      }
      pull = pull_in_memory = Vec4{};
    });
  });
}

}  // namespace drape::cpu
