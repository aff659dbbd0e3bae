#include "server/solver/cpu_reference/reference_self_contacts.h"

#include <algorithm>

#include "server/solver/cpu_reference/reference_stages.h"
#include "server/solver/solver_constants.h"

namespace drape::reference {

namespace {

using Eigen::Vector3d;
using self_contact::FromVector;
using VectorsOf = std::vector<Vector3d>& (*)(StepContext&);

std::vector<Vector3d>& Positions(StepContext& context) {
  return context.state.positions_m;
}
std::vector<Vector3d>& Velocities(StepContext& context) {
  return context.state.velocities_m_per_s;
}
std::vector<Vector3d>& PreviousPositions(StepContext& context) {
  return context.previous.positions_m;
}
std::vector<Vector3d>& PreviousVelocities(StepContext& context) {
  return context.previous.velocities_m_per_s;
}
std::vector<Vector3d>& Base(StepContext& context) {
  return context.base;
}
std::vector<Vector3d>& MeanVelocities(StepContext& context) {
  return context.u;
}

// Places in the frame of the world, or velocities: of all particles, cloth after cloth.
enum class Kind { kPlaces, kVelocities };

Vector3d OriginOf(const StepContext& context, Kind kind) {
  return kind == Kind::kPlaces ? context.origin_m : Vector3d::Zero();
}

std::vector<SelfVector> Gather(StepContexts& contexts, Kind kind, VectorsOf vectors_of) {
  std::vector<SelfVector> result;
  for (StepContext& context : contexts) {
    const Vector3d origin = OriginOf(context, kind);
    for (const Vector3d& v : vectors_of(context)) {
      result.push_back(self_contact::ToVector<SelfVector>(v + origin));
    }
  }
  return result;
}

// What contacts have changed goes back to the cloths; all else keeps its bits.
void Scatter(const std::vector<SelfVector>& vectors, StepContexts& contexts, Kind kind,
             VectorsOf vectors_of) {
  auto vector = vectors.begin();
  for (StepContext& context : contexts) {
    const Vector3d origin = OriginOf(context, kind);
    for (Vector3d& v : vectors_of(context)) {
      const Vector3d after = FromVector(*vector++);
      const Vector3d before = v + origin;
      if (after == before) continue;
      v = origin.isZero(0) ? after : Vector3d(v + (after - before));
    }
  }
}

// Of the cloth with the largest.
template <class NumberOf>
double Largest(const StepContexts& contexts, const NumberOf& number_of) {
  double largest = 0;
  for (const StepContext& context : contexts) largest = std::max(largest, number_of(context));
  return largest;
}

// The mean over the particles; one cloth: its own.
double EdgeLength(const StepContexts& contexts) {
  if (contexts.size() == 1) return contexts[0].model.length_scale_m();
  double sum_m = 0, particles = 0;
  for (const StepContext& context : contexts) {
    sum_m += context.model.particle_count() * context.model.length_scale_m();
    particles += context.model.particle_count();
  }
  return sum_m / particles;
}

}  // namespace

void ReferenceSelfContacts::Begin(StepContexts& contexts, const ContactSurface* surface,
                                  bool may_cross, Interruption* interruption) {
  surface_ = surface;
  if (surface == nullptr) return;
  for (const StepContext& context : contexts) {
    const SelfContactNumbers numbers = SelfContactOf(context.parameters);
    thicknesses_.push_back(numbers.thickness_m);
    frictions_.push_back({numbers.friction_static, numbers.friction_dynamic});
    inverse_masses_.insert(inverse_masses_.end(), context.w.begin(), context.w.end());
  }
  if (std::ranges::any_of(contexts, [](const auto& its) { return its.impulses != nullptr; })) {
    pulls_.assign(inverse_masses_.size(), SelfVector{});
    pulls_in_memory_ = pulls_;
  }
  const StepContext& first = contexts[0];
  const self_contact::StepNumbers<SelfVector> step{
      .thicknesses = {std::ranges::max(thicknesses_), thicknesses_},
      .frictions = frictions_,
      .depenetration_speed = kMaxDepenetrationSpeed_m_per_s,
      .gravity =
          Largest(contexts, [](const auto& its) { return its.parameters.gravity_m_per_s2.norm(); }),
      .slowest_landing =
          Largest(contexts, [](const auto& its) { return SlowestLanding(its.parameters); }),
      .grazing_sine = kGrazingSine,
      .touch_round_offs = kTouchRoundOffs,
      .edge_length = EdgeLength(contexts),
      .time_step = first.parameters.settings.time_step_s,
      .substeps = first.plan.schedule.size(),
      .has_two_steps = first.plan.solver.has_two_steps,
      .inverse_masses = inverse_masses_,
      .pulls = {pulls_, pulls_in_memory_},
      .interruption = interruption};
  contacts_.Begin(*surface, step, may_cross, Gather(contexts, Kind::kPlaces, Positions));
}

bool ReferenceSelfContacts::StartsCrossing(const StepContexts& contexts, size_t index) const {
  const std::vector<bool>& is_crossing = contacts_.is_crossing();
  if (surface_ == nullptr || is_crossing.empty()) return false;
  auto begin = is_crossing.begin();
  for (size_t k = 0; k < index; ++k) begin += contexts[k].model.particle_count();
  const auto end = begin + contexts[index].model.particle_count();
  return std::find(begin, end, true) != end;
}

void ReferenceSelfContacts::Find(StepContexts& contexts) {
  if (surface_ == nullptr) return;
  // Predict has not changed the state itself.
  starts_ = Gather(contexts, Kind::kPlaces, Positions);
  contacts_.Find(starts_, Gather(contexts, Kind::kVelocities, Velocities));
}

bool ReferenceSelfContacts::Solve(StepContexts& contexts) {
  if (surface_ == nullptr) return false;
  const std::vector<SelfVector> base = Gather(contexts, Kind::kPlaces, Base);
  std::vector<SelfVector> u = Gather(contexts, Kind::kVelocities, MeanVelocities);
  double least_m = contexts[0].plan.tolerance * contexts[0].model.length_scale_m();
  for (const StepContext& context : contexts) {
    least_m = std::min(least_m, context.plan.tolerance * context.model.length_scale_m());
  }
  const double h = contexts[0].h;
  const std::vector<SelfVector> before = u;
  const bool has_changed = contacts_.Solve(starts_.data(), base.data(), u.data(), h, least_m / h);
  TellChanges(contexts, before, u, false);
  Scatter(u, contexts, Kind::kVelocities, MeanVelocities);
  return has_changed;
}

uint32_t ReferenceSelfContacts::SweepsAfterHits(const StepContexts& contexts) const {
  const uint32_t asked = contexts[0].max_iterations;
  return surface_ == nullptr ? asked : contacts_.SweepsOf(asked);
}

void ReferenceSelfContacts::Guard(StepContexts& contexts) {
  if (surface_ == nullptr) return;
  std::vector<SelfVector> ends = Gather(contexts, Kind::kPlaces, Positions);
  std::vector<SelfVector> velocities = Gather(contexts, Kind::kVelocities, Velocities);
  std::vector<SelfVector> previous_positions = Gather(contexts, Kind::kPlaces, PreviousPositions);
  std::vector<SelfVector> previous_velocities =
      Gather(contexts, Kind::kVelocities, PreviousVelocities);
  const Substep& substep = contexts[0].substep;
  self_contact::PlanarGuard<SelfVector>::Motion motion{.starts = starts_,
                                                       .ends = ends,
                                                       .velocities = velocities,
                                                       .previous_velocities = {},
                                                       .previous_positions = {},
                                                       .inverse_masses = inverse_masses_,
                                                       .duration = substep.duration_s};
  if (substep.is_two_step) {
    motion.previous_velocities = previous_velocities;
    motion.previous_positions = previous_positions;
  }
  const std::vector<SelfVector> before = velocities, before_previous = previous_velocities;
  has_failed_ |= !contacts_.Guard(motion);
  TakePulls(contexts);
  TellChanges(contexts, before, velocities, false);
  TellChanges(contexts, before_previous, previous_velocities, true);
  Scatter(ends, contexts, Kind::kPlaces, Positions);
  Scatter(velocities, contexts, Kind::kVelocities, Velocities);
  if (!substep.is_two_step) return;
  Scatter(previous_positions, contexts, Kind::kPlaces, PreviousPositions);
  Scatter(previous_velocities, contexts, Kind::kVelocities, PreviousVelocities);
}

// Those of the substep that ends.
void ReferenceSelfContacts::TakePulls(const StepContexts& contexts) {
  size_t first = 0;
  for (const StepContext& context : contexts) {
    if (context.impulses != nullptr) {
      for (const Grip& held : context.held) {
        const size_t i = first + held.particle;
        context.impulses->ToHeld(held.particle, FromVector(pulls_[i]));
        context.impulses->ToHeldInMemory(held.particle, FromVector(pulls_in_memory_[i]));
        context.impulses->OnParticle(held.particle, ParticleImpulse::kCloth, FromVector(pulls_[i]));
        context.impulses->OnParticleInMemory(held.particle, ParticleImpulse::kCloth,
                                             FromVector(pulls_in_memory_[i]));
      }
    }
    first += context.model.particle_count();
  }
  std::ranges::fill(pulls_, SelfVector{});
  std::ranges::fill(pulls_in_memory_, SelfVector{});
}

void ReferenceSelfContacts::TellChanges(const StepContexts& contexts,
                                        const std::vector<SelfVector>& before,
                                        const std::vector<SelfVector>& after,
                                        bool in_memory) const {
  size_t first = 0;
  for (const StepContext& context : contexts) {
    const uint32_t count = context.model.particle_count();
    const bool is_asked = context.impulses != nullptr && context.impulses->has_contacts();
    for (uint32_t i = 0; is_asked && i < count; ++i) {
      if (context.w[i] == 0) continue;
      const double mass_kg = context.model.masses_kg()[i];
      const Vector3d impulse = mass_kg * FromVector(after[first + i] - before[first + i]);
      if (in_memory) {
        context.impulses->OnParticleInMemory(i, ParticleImpulse::kCloth, -impulse);
      } else {
        context.impulses->OnParticle(i, ParticleImpulse::kCloth, impulse);
      }
    }
    first += count;
  }
}

std::vector<self_contact::SelfContactMeasures> MeasureSelfContacts(
    const ContactSurface& surface, std::span<const MeasuredCloth> cloths,
    Interruption* interruption) {
  std::vector<SelfVector> positions;
  std::vector<double> thicknesses;
  for (const MeasuredCloth& cloth : cloths) {
    for (const Vector3d& p : cloth.state->positions_m) {
      positions.push_back(self_contact::ToVector<SelfVector>(p + cloth.origin_m));
    }
    thicknesses.push_back(SelfContactOf(*cloth.parameters).thickness_m);
  }
  return self_contact::MeasureSelfContacts(surface, {std::ranges::max(thicknesses), thicknesses},
                                           positions, interruption);
}

}  // namespace drape::reference
