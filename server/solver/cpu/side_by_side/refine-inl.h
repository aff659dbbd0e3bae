// Stage `refine` (server/solver/method.md) for a group of cloths. Compiled once per instruction
// set.
#if defined(DRAPE_CPU_SIDE_BY_SIDE_REFINE_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_SIDE_BY_SIDE_REFINE_INL_H_
#undef DRAPE_CPU_SIDE_BY_SIDE_REFINE_INL_H_
#else
#define DRAPE_CPU_SIDE_BY_SIDE_REFINE_INL_H_
#endif

#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/cpu/formulas/constraint_math-inl.h"
#include "server/solver/cpu/side_by_side/contacts-inl.h"
#include "server/solver/cpu/side_by_side/state-inl.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

using PlacesTag = hn::RebindToSigned<ClothsTag>;
using Places = hn::Vec<PlacesTag>;

// As many mixed links as there are lanes take about this many times as long as one link of each
// cloth, some lanes being empty [-] (tests/bench/notes/cpu.md).
constexpr size_t kMixedCost = 6;

// Links of whichever cloths, one in each lane: where few cloths move a link, all of them do not
// wait for it.
struct MixedLinks {
  Places from, to;  // the x of p of the ends, in floats from that of the first particle
  VecCloths rest_length, w_from, w_to;
  VectorsCloths way;  // of `to` in the substep, less that of `from` [m]
};

// Particles of whichever cloths, one in each lane.
class MixedParticles {
 public:
  explicit MixedParticles(ClothParticle* particles) : first_(reinterpret_cast<float*>(particles)) {}

  VectorsCloths Positions(Places at) const { return VectorsAt(at, 0); }
  VectorsCloths Velocities(Places at) const { return VectorsAt(at, 3); }
  void SetPositions(Places at, const VectorsCloths& p) const {
    const ClothsTag tag;
    hn::ScatterIndex(p.x.v, tag, first_, at);
    hn::ScatterIndex(p.y.v, tag, first_ + kClothCount, at);
    hn::ScatterIndex(p.z.v, tag, first_ + 2 * kClothCount, at);
  }
  static int32_t PlaceOf(uint32_t particle, uint32_t cloth) {
    static_assert(sizeof(ClothParticle) == 6 * kClothCount * sizeof(float));
    return static_cast<int32_t>(particle * 6 * kClothCount + cloth);
  }

 private:
  VectorsCloths VectorsAt(Places at, size_t axis) const {
    const ClothsTag tag;
    const float* const x = first_ + axis * kClothCount;
    return {{hn::GatherIndex(tag, x, at)},
            {hn::GatherIndex(tag, x + kClothCount, at)},
            {hn::GatherIndex(tag, x + 2 * kClothCount, at)}};
  }

  float* const first_;
};

// Fills lanes with links, one after the other.
class LinkMixer {
 public:
  explicit LinkMixer(const GroupContext& context)
      : context_(context), particles_(context.particles) {
    const VecCloths none = SplatCloths(0);
    ClothParticle& spare = context.particles[context.model.spare_particle()];
    spare = {{none, none, none}, {none, none, none}};
  }

  bool is_empty() const { return count_ == 0; }
  bool is_full() const { return count_ == kClothCount; }
  void Add(uint32_t place, uint32_t cloth) {
    const DistanceGroup& group = context_.model.groups[place / kVec4Size];
    const uint32_t k = place % kVec4Size;
    Set(MixedParticles::PlaceOf(group.i[k], cloth), MixedParticles::PlaceOf(group.j[k], cloth),
        group.rest_length[k], InverseMass(group.i[k], cloth), InverseMass(group.j[k], cloth));
  }
  // The lanes that are left have a link that nothing moves.
  MixedLinks Take() {
    while (!is_full()) {
      const int32_t none = MixedParticles::PlaceOf(context_.model.spare_particle(), count_);
      Set(none, none, 1, 0, 0);
    }
    count_ = 0;
    const Places from = hn::Load(PlacesTag(), from_), to = hn::Load(PlacesTag(), to_);
    const VectorsCloths speed = particles_.Velocities(to) - particles_.Velocities(from);
    return {from,
            to,
            LoadCloths(rest_length_),
            LoadCloths(w_from_),
            LoadCloths(w_to_),
            speed * context_.substep.interval};
  }

 private:
  void Set(int32_t from, int32_t to, float rest_length, float w_from, float w_to) {
    from_[count_] = from;
    to_[count_] = to;
    rest_length_[count_] = rest_length;
    w_from_[count_] = w_from;
    w_to_[count_] = w_to;
    ++count_;
  }
  float InverseMass(uint32_t i, uint32_t cloth) const {
    if (!context_.has_own_pins()) return context_.model.inverse_masses[i];
    return reinterpret_cast<const float*>(
        context_.own_pins.inverse_masses)[i * kClothCount + cloth];
  }

  const GroupContext& context_;
  const MixedParticles particles_;
  uint32_t count_ = 0;
  alignas(64) int32_t from_[kClothCount], to_[kClothCount];
  alignas(64) float rest_length_[kClothCount], w_from_[kClothCount], w_to_[kClothCount];
};

// Where links exceed the limits of the refinement (equation 32). `d`: from end to end.
MaskCloths ExceedLimits(const RefineLimits& limits, const VectorsCloths& d, VecCloths rest_length) {
  const VecCloths length_sq = Dot(d, d), rest_length_sq = rest_length * rest_length;
  return (length_sq < rest_length_sq * limits.min_sq) |
         (length_sq > rest_length_sq * limits.max_sq);
}

// The ends of links come to lie at the lengths of these (equation 33).
HWY_INLINE void MoveToLength(const VectorsCloths& d, VecCloths rest_length, VecCloths w_from,
                             VecCloths w_to, MaskCloths is_moved, VectorsCloths& from,
                             VectorsCloths& to) {
  const VecCloths length = Sqrt(Dot(d, d));
  const VectorsCloths n = Directions(d, length);
  const VecCloths sum = w_from + w_to, zero = SplatCloths(0);
  const VecCloths move = Select(is_moved & (sum > zero), (length - rest_length) / sum, zero);
  from = from + (w_from * move) * n;
  to = to - (w_to * move) * n;
}

// The cloths in which the link at this place is stretched.
MaskCloths AreStretched(const GroupContext& context, uint32_t place) {
  const DistanceGroup& group = context.model.groups[place / kVec4Size];
  const uint32_t k = place % kVec4Size;
  const float interval = context.substep.interval;
  const ClothParticle& from = context.particles[group.i[k]];
  const ClothParticle& to = context.particles[group.j[k]];
  const VectorsCloths d = (to.p + to.u * interval) - (from.p + from.u * interval);
  const MaskCloths are_stretched =
      context.is_running &
      ExceedLimits(context.controls.refine_limits, d, SplatCloths(group.rest_length[k]));
  if (!context.has_own_pins() || !IsAnyLaneSet(are_stretched)) return are_stretched;
  return are_stretched & IsLoose(context, group.i[k], group.j[k]);
}

// Moves the ends of a link in some of the cloths so that it has its length at the end of the
// substep.
void MoveEnds(const GroupContext& context, const RefinedLink& link) {
  const DistanceGroup& group = context.model.groups[link.place / kVec4Size];
  const uint32_t k = link.place % kVec4Size;
  ClothParticle& from = context.particles[group.i[k]];
  ClothParticle& to = context.particles[group.j[k]];
  const VectorsCloths d = (to.p - from.p) + (to.u - from.u) * context.substep.interval;
  MoveToLength(d, SplatCloths(group.rest_length[k]), context.InverseMass(group.i[k]),
               context.InverseMass(group.j[k]), MaskOf(link.cloths), from.p, to.p);
}

// function(cloth) of each of `cloths`, one bit each.
template <class Function>
void ForEachCloth(uint32_t cloths, const Function& function) {
  for (; cloths != 0; cloths &= cloths - 1) {
    function(static_cast<uint32_t>(std::countr_zero(cloths)));
  }
}

// The links of one colour share no particles: they can be moved side by side.
std::span<const MixedLinks> MixWithinColours(const GroupContext& context,
                                             std::span<const RefinedLink> links,
                                             size_t link_count) {
  const std::vector<uint32_t>& colours = context.model.colour_offsets;
  MixedLinks* const mixed =
      context.mixed_links.Reserve<MixedLinks>(link_count / kClothCount + colours.size());
  size_t count = 0;
  LinkMixer mixer(context);
  const auto take = [&] {
    if (!mixer.is_empty()) mixed[count++] = mixer.Take();
  };
  size_t colour = 0;
  for (const RefinedLink& link : links) {
    while (link.place / kVec4Size >= colours[colour + 1]) {
      take();
      ++colour;
    }
    ForEachCloth(link.cloths, [&](uint32_t cloth) {
      mixer.Add(link.place, cloth);
      if (mixer.is_full()) take();
    });
  }
  take();
  return {mixed, count};
}

// kRefineSweeps times what MoveEnds does.
void MoveMixed(const GroupContext& context, std::span<const RefinedLink> links, size_t link_count) {
  const MixedParticles particles(context.particles);
  const std::span<const MixedLinks> all = MixWithinColours(context, links, link_count);
  const MaskCloths everywhere = SplatCloths(0) >= SplatCloths(0);
  for (unsigned sweep = 0; sweep < kRefineSweeps; ++sweep) {
    for (const MixedLinks& mixed : all) {
      VectorsCloths from = particles.Positions(mixed.from), to = particles.Positions(mixed.to);
      MoveToLength((to - from) + mixed.way, mixed.rest_length, mixed.w_from, mixed.w_to, everywhere,
                   from, to);
      particles.SetPositions(mixed.from, from);
      particles.SetPositions(mixed.to, to);
    }
  }
}

// Moves all links, kRefineSweeps times, in the way that takes less time.
void MoveLinks(const GroupContext& context, std::span<const RefinedLink> links) {
  size_t count = 0;
  for (const RefinedLink& link : links) count += static_cast<size_t>(std::popcount(link.cloths));
  if (kMixedCost * count <= links.size() * kClothCount) return MoveMixed(context, links, count);
  for (unsigned sweep = 0; sweep < kRefineSweeps; ++sweep) {
    for (const RefinedLink& link : links) MoveEnds(context, link);
  }
}

// Moves the links that exceed the limits after the strips, and the links at their ends, to their
// lengths, one by one.
void Refine(const GroupContext& context) {
  if (!context.controls.Has(StepStage::kRefine)) return;
  Refinement& refinement = context.refinement;
  refinement.Begin(context.model);
  for (const uint32_t place : context.model.constraint_places) {
    const MaskCloths are_stretched = AreStretched(context, place);
    if (IsAnyLaneSet(are_stretched)) [[unlikely]] {
      refinement.Mark(place, BitsOf(are_stretched));
    }
  }
  const auto move = [&](std::span<const RefinedLink> links) { MoveLinks(context, links); };
  const auto stretched_in = [&](uint32_t place) { return BitsOf(AreStretched(context, place)); };
  if (refinement.Run(context.controls.plan.solver, move, stretched_in)) {
    FindContactFloors(context);
  }
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
