#include "server/solver/cpu/step/impulse_sums.h"

#include "server/solver/cpu/step/impulse_total.h"
#include "server/solver/cpu/step/step_context.h"

namespace drape::cpu {
namespace {

Vec4 Cross(Vec4 a, Vec4 b) {
  return Vec4{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], 0};
}

}  // namespace

void ImpulseSums::Begin(const FloatModel& model, size_t near_count, bool has_contacts) {
  near_count_ = near_count;
  particles_.assign(model.particle_count + size_t{1}, Vec4{});
  strip_links_.assign(model.strip_links.size() * kVec8Size, Vec4{});
  strip_firsts_.assign(model.strips.size() * kVec8Size, Vec4{});
  constraints_.assign(model.groups.size() * kVec4Size * 2, Vec4{});
  tethers_.assign(model.tethers.size() * kVec4Size, Vec4{});
  contacts_.assign(model.particle_count * near_count, Contact{});
  by_cloth_.assign(has_contacts ? model.particle_count : 0, Vec4{});
}

void ImpulseSums::BeginSubstep(const StepContext& context, uint32_t index, double substep_s) {
  const FloatControls& controls = context.controls;
  const ImpulseWeights weights =
      ImpulseWeightsOf(controls.plan.schedule, index, controls.damping_per_s);
  weight_ = static_cast<float>(weights.impulse);
  memory_weight_ = static_cast<float>(weights.memory);
  pivots_ = PivotsAt(context, context.scratch.reach.near, (index + 1) * substep_s);
}

void ImpulseSums::Add(uint32_t particle, size_t k, Vec4 impulse, Vec4 place_m) {
  Contact& contact = contacts_[particle * near_count_ + k];
  contact.impulse += impulse;
  contact.moment += Cross(place_m - pivots_[k], impulse);
}

StepImpulses ImpulseSums::Total(const StepContext& context, const FloatState& start) const {
  const FloatModel& model = context.model;
  ImpulseTotal total(context);
  for (uint32_t i = 0; i < model.particle_count; ++i) {
    total.Pull(i, particles_[i]);
    for (size_t k = 0; k < near_count_; ++k) {
      const Contact& contact = contacts_[i * near_count_ + k];
      total.Push(i, k, contact.impulse, contact.moment);
    }
    if (!by_cloth_.empty()) total.PushByCloth(i, by_cloth_[i]);
  }
  const auto add_lanes = [&](const auto& ends, const Vec4* pulls) {
    for (uint32_t lane = 0; lane < kVec8Size; ++lane) total.Pull(ends[lane], pulls[lane]);
  };
  for (size_t g = 0; g < model.strips.size(); ++g) {
    const StripGroup& strips = model.strips[g];
    add_lanes(strips.first, strip_firsts_.data() + g * kVec8Size);
    for (uint32_t k = strips.link_begin; k < strips.link_end; ++k) {
      add_lanes(model.strip_links[k].to, strip_links_.data() + size_t{k} * kVec8Size);
    }
  }
  for (size_t place = 0; place < model.groups.size() * kVec4Size; ++place) {
    const DistanceGroup& group = model.groups[place / kVec4Size];
    total.Pull(group.i[place % kVec4Size], constraints_[2 * place]);
    total.Pull(group.j[place % kVec4Size], constraints_[2 * place + 1]);
  }
  for (size_t place = 0; place < model.tethers.size() * kVec4Size; ++place) {
    total.Pull(model.tethers[place / kVec4Size].pin[place % kVec4Size], tethers_[place]);
  }
  return total.Take(start);
}

}  // namespace drape::cpu
