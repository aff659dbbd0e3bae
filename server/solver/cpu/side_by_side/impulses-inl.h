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
        near_(scratch.reaches[0].near),
        pivots_(scratch.impulse_pivots.Reserve<VectorsCloths>(near_.size())),
        right_sides_(scratch.right_sides.Reserve<VectorsPair>(model.longest_elastic_line)),
        hinges_(scratch.held_hinges.Reserve<VectorsCloths>(held().size())) {
    const size_t places = model.groups.size() * kVec4Size;
    const size_t counts[] = {model.particle_count + size_t{1},
                             2 * model.pair_links.size(),
                             2 * model.strip_pairs.size(),
                             2 * places,
                             tether_count(),
                             2 * model.particle_count * near_.size()};
    size_t count = 0;
    for (const size_t of_kind : counts) count += of_kind;
    VectorsCloths* next = scratch.impulse_sums.Reserve<VectorsCloths>(count);
    std::fill_n(next, count, None());
    VectorsCloths** const kinds[] = {&particles_,   &strip_links_, &strip_firsts_,
                                     &constraints_, &tethers_,     &contacts_};
    for (size_t kind = 0; kind < std::size(kinds); ++kind) {
      *kinds[kind] = next;
      next += counts[kind];
    }
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

  void Pull(uint32_t particle, const VectorsCloths& impulse) const {
    Increase(particles_[particle], weight_ * impulse);
  }
  void PullAtLink(size_t link, const VectorsPair& impulses) const {
    Increase(strip_links_[2 * link], weight_ * Low(impulses));
    Increase(strip_links_[2 * link + 1], weight_ * High(impulses));
  }
  void PullAtFirst(size_t pair, const VectorsPair& impulses) const {
    Increase(strip_firsts_[2 * pair], weight_ * Low(impulses));
    Increase(strip_firsts_[2 * pair + 1], weight_ * High(impulses));
  }
  void PullAtConstraint(size_t place, const VectorsCloths& impulse) const {
    Increase(constraints_[2 * place], weight_ * (None() - impulse));
    Increase(constraints_[2 * place + 1], weight_ * impulse);
  }
  void PullAtTether(size_t tether, const VectorsCloths& impulse) const {
    Increase(tethers_[tether], weight_ * impulse);
  }
  void Push(uint32_t particle, size_t k, const VectorsCloths& impulse,
            const VectorsCloths& place_m) const {
    Add(particle, k, weight_ * impulse, place_m);
  }
  void PushInMemory(uint32_t particle, size_t k, const VectorsCloths& impulse,
                    const VectorsCloths& place_m) const {
    Add(particle, k, memory_weight_ * impulse, place_m);
  }
  // Of each of held(), by hinges; of the longest line of elastic elements.
  VectorsCloths* hinges() const { return hinges_; }
  VectorsPair* right_sides() const { return right_sides_; }

  // After the step, whose outcome is in the scratch state of the cloth.
  StepImpulses Total(size_t lane, const GroupCloth& cloth) const {
    ImpulseTotal total(cloth.context);
    for (uint32_t i = 0; i < model_.particle_count; ++i) {
      if (IsHeld(i)) total.Pull(i, VectorOfLane(particles_[i], lane));
      for (size_t k = 0; k < near_.size(); ++k) {
        const VectorsCloths* const contact = contacts_ + 2 * (i * near_.size() + k);
        total.Push(k, VectorOfLane(contact[0], lane), VectorOfLane(contact[1], lane));
      }
    }
    const auto add = [&](uint32_t i, const VectorsCloths& pull) {
      if (IsHeld(i)) total.Pull(i, VectorOfLane(pull, lane));
    };
    for (size_t k = 0; k < 2 * model_.pair_links.size(); ++k) {
      add(model_.pair_links[k / 2].to[k % 2], strip_links_[k]);
    }
    for (size_t k = 0; k < 2 * model_.strip_pairs.size(); ++k) {
      add(model_.strip_pairs[k / 2].first[k % 2], strip_firsts_[k]);
    }
    for (size_t place = 0; place < model_.groups.size() * kVec4Size; ++place) {
      const DistanceGroup& group = model_.groups[place / kVec4Size];
      add(group.i[place % kVec4Size], constraints_[2 * place]);
      add(group.j[place % kVec4Size], constraints_[2 * place + 1]);
    }
    const std::span<const uint32_t> own_held = cloth.context.held.particles;
    for (size_t t = 0; t < tether_count(); ++t) {
      const uint32_t pin = PinOf(t, lane);
      if (pin < own_held.size()) total.Pull(own_held[pin], VectorOfLane(tethers_[t], lane));
    }
    return total.Take(cloth.state);
  }

 private:
  size_t tether_count() const {
    return lists_ != nullptr ? lists_->tethers.size() : model_.single_tethers.size();
  }
  // The pin of a cloth, by its index, to which tether t leads, if it has that tether.
  uint32_t PinOf(size_t t, size_t lane) const {
    if (lists_ == nullptr) return model_.single_tethers[t].pin_index;
    const OwnTether& tether = lists_->tethers[t];
    for (uint32_t e = tether.others_begin; e < tether.others_end; ++e) {
      const TetherEnd& end = lists_->tether_ends[e];
      if ((end.cloths >> lane & 1) != 0) return end.pin;
    }
    return tether.pin;
  }
  static const StepContext& OfLane(std::span<const GroupCloth> cloths, size_t lane) {
    return cloths[std::min(lane, cloths.size() - 1)].context;
  }
  static void SetLane(VectorsCloths& vectors, size_t lane, Vec4 vector) {
    vectors.x.v = hn::InsertLane(vectors.x.v, lane, vector[0]);
    vectors.y.v = hn::InsertLane(vectors.y.v, lane, vector[1]);
    vectors.z.v = hn::InsertLane(vectors.z.v, lane, vector[2]);
  }
  static void Increase(VectorsCloths& sum, const VectorsCloths& change) {
    Assign(sum, sum + change);
  }
  void Add(uint32_t particle, size_t k, const VectorsCloths& impulse,
           const VectorsCloths& place_m) const {
    VectorsCloths* const contact = contacts_ + 2 * (particle * near_.size() + k);
    Increase(contact[0], impulse);
    Increase(contact[1], Cross(place_m - pivots_[k], impulse));
  }

  const FloatModel& model_;       // or the layout of several
  const PinLists* const lists_;  // null: all cloths hold the same
  const std::span<const uint32_t> near_;
  VecCloths weight_ = SplatCloths(1), memory_weight_ = SplatCloths(0);
  VectorsCloths* particles_ = nullptr;     // [particle_count + 1]
  VectorsCloths* strip_links_ = nullptr;   // [pair_links][2]
  VectorsCloths* strip_firsts_ = nullptr;  // [strip_pairs][2]
  VectorsCloths* constraints_ = nullptr;   // [groups][lane][end]
  VectorsCloths* tethers_ = nullptr;       // [tether_count]
  VectorsCloths* contacts_ = nullptr;      // [particle_count][near]: impulse, moment
  VectorsCloths* const pivots_;            // [near]
  VectorsPair* const right_sides_;
  VectorsCloths* const hinges_;  // [held]
};

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
