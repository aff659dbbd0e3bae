// What a step of a group of cloths gives to what they hold and to colliders: what ImpulseSums are
// for one cloth. Sums of particles that some of the cloths hold have numbers of all; Total takes
// those of the cloths that hold them. Compiled once per instruction set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_IMPULSES_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_IMPULSES_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_IMPULSES_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_IMPULSES_INL_H_
#endif

#include <algorithm>
#include <span>
#include <vector>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/side_by_side/group.h"
#include "server/solver/cpu/side_by_side/pin_lists.h"
#include "server/solver/cpu/simd/vec_cloths-inl.h"
#include "server/solver/cpu/step/impulse_total.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

HWY_INLINE Vec4 VectorOfLane(const VectorsCloths& vectors, size_t lane) {
  return Vec4{hn::ExtractLane(vectors.x.v, lane), hn::ExtractLane(vectors.y.v, lane),
              hn::ExtractLane(vectors.z.v, lane), 0};
}

class GroupImpulses {
 public:
  // Of the colliders in reach. `lists`: of what the cloths hold, if they do not hold the same, else
  // null.
  GroupImpulses(const FloatModel& model, const PinLists* lists, GroupScratch& scratch)
      : model_(model),
        lists_(lists),
        one_model_(lists == nullptr ? &model : lists->one_model),
        near_(scratch.reaches[0].near),
        pivots_(scratch.impulse_pivots.Reserve<VectorsCloths>(near_.size())),
        right_sides_(scratch.right_sides.Reserve<VectorsPair>(model.longest_elastic_line)),
        hinges_(scratch.held_hinges.Reserve<VectorsCloths>(held().size())),
        links_(model.particle_count + size_t{1}),
        firsts_(links_ + 2 * model.pair_links.size()),
        constraints_(firsts_ + 2 * model.strip_pairs.size()),
        tethers_(constraints_ + 2 * model.groups.size() * kVec4Size),
        contacts_(tethers_ + tether_count()),
        moments_(contacts_ + model.particle_count * near_.size()),
        sums_(scratch.impulse_sums.Reserve<VectorsCloths>(moments_ +
                                                          model.particle_count * near_.size())),
        has_sum_(scratch.has_impulse_sum),
        places_(scratch.impulse_places) {
    has_sum_.assign(moments_, 0);
    places_.clear();
  }

  static VectorsCloths None() { return {SplatCloths(0), SplatCloths(0), SplatCloths(0)}; }

  // Substep `index` of all cloths, which lasts for `substep_s`.
  void BeginSubstep(std::span<const GroupCloth> cloths, uint32_t index, double substep_s) {
    alignas(64) float weights[kClothCount];
    ImpulseWeights of_cloth;
    for (size_t lane = 0; lane < kClothCount; ++lane) {
      const FloatControls& controls = OfLane(cloths, lane).controls;
      of_cloth = ImpulseWeightsOf(controls.plan.schedule, index, controls.damping_per_s);
      weights[lane] = static_cast<float>(of_cloth.impulse);
    }
    weight_ = LoadCloths(weights);
    memory_weight_ = SplatCloths(static_cast<float>(of_cloth.memory));
    for (size_t lane = 0; lane < cloths.size(); ++lane) {
      const std::vector<Vec4> pivots =
          PivotsAt(cloths[lane].context, near_, (index + 1) * substep_s);
      for (size_t k = 0; k < near_.size(); ++k) SetLane(pivots_[k], lane, pivots[k]);
    }
  }

  // The particles that some cloth holds, ascending.
  std::span<const uint32_t> held() const {
    return lists_ != nullptr ? lists_->held_particles : model_.pins;
  }
  // Whether particle i is one of them.
  HWY_INLINE bool IsHeld(uint32_t i) const {
    if (i >= model_.particle_count) return false;
    return lists_ != nullptr ? lists_->held_by[i] != 0 : !model_.IsFree(i);
  }
  // Of particle i where it is free [kg].
  VecCloths Mass(uint32_t i) const {
    return SplatCloths(static_cast<float>(model_.source->masses_kg()[i]));
  }

  // Of a particle that some cloth holds.
  void Pull(uint32_t particle, const VectorsCloths& impulse) const {
    Add(particle, weight_ * impulse);
  }
  void PullAtLink(size_t link, const VectorsPair& impulses) const {
    Add(links_ + 2 * link, weight_ * Low(impulses));
    Add(links_ + 2 * link + 1, weight_ * High(impulses));
  }
  void PullAtFirst(size_t pair, const VectorsPair& impulses) const {
    Add(firsts_ + 2 * pair, weight_ * Low(impulses));
    Add(firsts_ + 2 * pair + 1, weight_ * High(impulses));
  }
  // At the ends i and j of the constraint.
  void PullAtConstraint(size_t place, uint32_t i, uint32_t j, const VectorsCloths& impulse) const {
    if (IsHeld(i)) Add(constraints_ + 2 * place, weight_ * (None() - impulse));
    if (IsHeld(j)) Add(constraints_ + 2 * place + 1, weight_ * impulse);
  }
  void PullAtTether(size_t tether, const VectorsCloths& impulse) const {
    Add(tethers_ + tether, weight_ * impulse);
  }
  void Push(uint32_t particle, size_t k, const VectorsCloths& impulse,
            const VectorsCloths& place_m) const {
    PushAt(particle, k, weight_ * impulse, place_m);
  }
  void PushInMemory(uint32_t particle, size_t k, const VectorsCloths& impulse,
                    const VectorsCloths& place_m) const {
    PushAt(particle, k, memory_weight_ * impulse, place_m);
  }
  // Of each of held(), by hinges; of the longest line of elastic elements.
  VectorsCloths* hinges() const { return hinges_; }
  VectorsPair* right_sides() const { return right_sides_; }

  // After the step, whose outcome is in the scratch state of the cloth.
  StepImpulses Total(size_t lane, const GroupCloth& cloth) const {
    ImpulseTotal total(cloth.context);
    const std::span<const uint32_t> own_held = cloth.context.held.particles;
    for (const uint32_t place : places_) {
      const Vec4 impulse = VectorOfLane(sums_[place], lane);
      if (place >= contacts_) {
        const size_t contact = place - contacts_;
        total.Push(static_cast<uint32_t>(contact / near_.size()), contact % near_.size(), impulse,
                   VectorOfLane(sums_[moments_ + contact], lane));
      } else if (place >= tethers_) {
        const uint32_t pin = PinOf(place - tethers_, lane);
        if (pin < own_held.size()) total.Pull(own_held[pin], impulse);
      } else {
        total.Pull(ParticleAt(place), impulse);
      }
    }
    return total.Take(cloth.state);
  }

 private:
  size_t tether_count() const {
    return one_model_ != nullptr ? one_model_->single_tethers.size() : lists_->tethers.size();
  }
  // The pin of a cloth, by its index, to which tether t leads, if it has that tether.
  uint32_t PinOf(size_t t, size_t lane) const {
    if (one_model_ != nullptr) return one_model_->single_tethers[t].pin_index;
    const OwnTether& tether = lists_->tethers[t];
    for (uint32_t e = tether.others_begin; e < tether.others_end; ++e) {
      const TetherEnd& end = lists_->tether_ends[e];
      if ((end.cloths >> lane & 1) != 0) return end.pin;
    }
    return tether.pin;
  }
  // The particle on which the impulses at a place before those of tethers act.
  uint32_t ParticleAt(size_t place) const {
    if (place >= constraints_) {
      const size_t end = place - constraints_, constraint = end / 2;
      const DistanceGroup& group = model_.groups[constraint / kVec4Size];
      return (end % 2 == 0 ? group.i : group.j)[constraint % kVec4Size];
    }
    if (place >= firsts_) {
      return model_.strip_pairs[(place - firsts_) / 2].first[(place - firsts_) % 2];
    }
    if (place >= links_) return model_.pair_links[(place - links_) / 2].to[(place - links_) % 2];
    return static_cast<uint32_t>(place);
  }
  static const StepContext& OfLane(std::span<const GroupCloth> cloths, size_t lane) {
    return cloths[std::min(lane, cloths.size() - 1)].context;
  }
  static void SetLane(VectorsCloths& vectors, size_t lane, Vec4 vector) {
    vectors.x.v = hn::InsertLane(vectors.x.v, lane, vector[0]);
    vectors.y.v = hn::InsertLane(vectors.y.v, lane, vector[1]);
    vectors.z.v = hn::InsertLane(vectors.z.v, lane, vector[2]);
  }
  // Whether this is the first impulse at the place.
  HWY_INLINE bool IsFirst(size_t place) const {
    if (has_sum_[place] != 0) return false;
    has_sum_[place] = 1;
    places_.push_back(static_cast<uint32_t>(place));
    return true;
  }
  HWY_INLINE void Add(size_t place, const VectorsCloths& impulse) const {
    Assign(sums_[place], IsFirst(place) ? impulse : sums_[place] + impulse);
  }
  void PushAt(uint32_t particle, size_t k, const VectorsCloths& impulse,
              const VectorsCloths& place_m) const {
    const VecCloths zero = SplatCloths(0);
    if (!IsAnyLaneSet((impulse.x != zero) | (impulse.y != zero) | (impulse.z != zero))) return;
    const size_t contact = particle * near_.size() + k;
    VectorsCloths& sum = sums_[contacts_ + contact];
    VectorsCloths& moment = sums_[moments_ + contact];
    const VectorsCloths added = Cross(place_m - pivots_[k], impulse);
    const bool is_first = IsFirst(contacts_ + contact);
    Assign(sum, is_first ? impulse : sum + impulse);
    Assign(moment, is_first ? added : moment + added);
  }

  const FloatModel& model_;            // or the layout of several
  const PinLists* const lists_;        // null: all cloths hold the same
  const FloatModel* const one_model_;  // null: several
  const std::span<const uint32_t> near_;
  VecCloths weight_ = SplatCloths(1), memory_weight_ = SplatCloths(0);
  VectorsCloths* const pivots_;  // [near]
  VectorsPair* const right_sides_;
  VectorsCloths* const hinges_;  // [held]
  // Where the sums of each kind begin. First [particle_count + 1], then
  const size_t links_;        // [pair_links][2]
  const size_t firsts_;       // [strip_pairs][2]
  const size_t constraints_;  // [groups][lane][end]
  const size_t tethers_;      // [tether_count]
  const size_t contacts_;     // [particle_count][near]
  const size_t moments_;      // of these
  VectorsCloths* const sums_;
  std::vector<uint8_t>& has_sum_;  // of each place but moments: whether anything was added
  std::vector<uint32_t>& places_;  // those that have
};

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
