// Particles of one cloth, one in each lane. Compiled once per instruction set.
#if defined(DRAPE_CPU_ALONE_PARTICLE_BLOCK_INL_H_) == defined(HWY_TARGET_TOGGLE)
#ifdef DRAPE_CPU_ALONE_PARTICLE_BLOCK_INL_H_
#undef DRAPE_CPU_ALONE_PARTICLE_BLOCK_INL_H_
#else
#define DRAPE_CPU_ALONE_PARTICLE_BLOCK_INL_H_
#endif

#include <hwy/highway.h>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "server/solver/cpu/simd/transpose-inl.h"
#include "server/solver/cpu/step/lane_clearance-inl.h"
#include "server/solver/cpu/step/step_context.h"

HWY_BEFORE_NAMESPACE();
namespace drape::cpu::HWY_NAMESPACE {
namespace {

// function(lane) of each lane that is set.
template <class Function>
HWY_INLINE void ForLanes(MaskCloths lanes, const Function& function) {
  for (uint32_t bits = BitsOf(lanes); bits != 0; bits &= bits - 1) {
    function(static_cast<uint32_t>(std::countr_zero(bits)));
  }
}

// A vector of each lane, one after the other.
struct LaneVectors {
  explicit LaneVectors(const VectorsCloths& vectors) {
    Vec4* places[kClothCount];
    for (uint32_t lane = 0; lane < kClothCount; ++lane) places[lane] = values + lane;
    StoreVectors(vectors, places, 0);
  }

  alignas(64) Vec4 values[kClothCount];
};

class ParticleBlock {
 public:
  // At least one and at most as many as there are lanes; those beyond are like the first one.
  explicit ParticleBlock(std::span<const uint32_t> particles) : count_(particles.size()) {
    for (uint32_t lane = 0; lane < kClothCount; ++lane) {
      particles_[lane] = particles[lane < count_ ? lane : 0];
    }
  }

  MaskCloths lanes() const { return MaskOf((uint32_t{1} << count_) - 1); }
  uint32_t particle(uint32_t lane) const { return particles_[lane]; }

  VectorsCloths Load(const std::vector<Vec4>& vectors) const {
    if (FollowEachOther()) {
      const ClothsTag tag;
      FloatVec x, y, z, unused;
      hn::LoadInterleaved4(tag, reinterpret_cast<const float*>(&vectors[particles_[0]]), x, y, z,
                           unused);
      return {{x}, {y}, {z}};
    }
    return LoadOf([&](uint32_t i) { return &vectors[i]; });
  }
  void Store(const VectorsCloths& values, std::vector<Vec4>& vectors) const {
    if (FollowEachOther()) {
      const ClothsTag tag;
      return hn::StoreInterleaved4(values.x.v, values.y.v, values.z.v, hn::Zero(tag), tag,
                                   reinterpret_cast<float*>(&vectors[particles_[0]]));
    }
    StoreOf(values, [&](uint32_t i) { return &vectors[i]; });
  }
  // With the collider k of `count`.
  ClothContact LoadContact(const std::vector<ContactImpulses>& contacts, size_t count,
                           size_t k) const {
    const VectorsCloths numbers = LoadOf(
        [&](uint32_t i) { return reinterpret_cast<const Vec4*>(&contacts[i * count + k].normal); });
    return {LoadOf([&](uint32_t i) { return &contacts[i * count + k].tangent; }), numbers.x,
            numbers.y, numbers.z};
  }
  void StoreContact(const ClothContact& contact, std::vector<ContactImpulses>& contacts,
                    size_t count, size_t k) const {
    StoreOf(contact.tangent, [&](uint32_t i) { return &contacts[i * count + k].tangent; });
    StoreOf({contact.normal, contact.floor, contact.rebound},
            [&](uint32_t i) { return reinterpret_cast<Vec4*>(&contacts[i * count + k].normal); });
  }
  ClothClearance LoadClearance(Clearances& clearances, size_t k) const {
    const auto row = [&](Clearances::Number number) { return LoadRow(clearances.Row(k, number)); };
    return {{row(Clearances::kX), row(Clearances::kY), row(Clearances::kZ)},
            row(Clearances::kWay),
            row(Clearances::kTime),
            row(Clearances::kArm)};
  }
  void StoreClearance(const ClothClearance& clearance, Clearances& clearances, size_t k) const {
    const auto store = [&](VecCloths values, Clearances::Number number) {
      StoreRow(values, clearances.Row(k, number));
    };
    store(clearance.place.x, Clearances::kX);
    store(clearance.place.y, Clearances::kY);
    store(clearance.place.z, Clearances::kZ);
    store(clearance.way, Clearances::kWay);
    store(clearance.at_s, Clearances::kTime);
    store(clearance.arm, Clearances::kArm);
  }

 private:
  using FloatVec = hn::Vec<ClothsTag>;
  // Two vectors, the second of three numbers.
  static_assert(sizeof(ContactImpulses) == 2 * sizeof(Vec4));
  static_assert(offsetof(ContactImpulses, normal) == sizeof(Vec4));

  bool FollowEachOther() const {
    return count_ == kClothCount && particles_[kClothCount - 1] - particles_[0] == kClothCount - 1;
  }
  HWY_INLINE VecCloths LoadRow(const float* row) const {
    if (FollowEachOther()) return {hn::LoadU(ClothsTag(), row + particles_[0])};
    alignas(64) float values[kClothCount];
    for (uint32_t lane = 0; lane < kClothCount; ++lane) values[lane] = row[particles_[lane]];
    return LoadCloths(values);
  }
  HWY_INLINE void StoreRow(VecCloths values, float* row) const {
    if (FollowEachOther()) return hn::StoreU(values.v, ClothsTag(), row + particles_[0]);
    alignas(64) float of_lanes[kClothCount];
    hn::Store(values.v, ClothsTag(), of_lanes);
    for (uint32_t lane = 0; lane < count_; ++lane) row[particles_[lane]] = of_lanes[lane];
  }

  template <class Place>
  HWY_INLINE VectorsCloths LoadOf(const Place& place) const {
    const Vec4* places[kClothCount];
    for (uint32_t lane = 0; lane < kClothCount; ++lane) places[lane] = place(particles_[lane]);
    return LoadVectors(places, 0);
  }
  template <class Place>
  HWY_INLINE void StoreOf(const VectorsCloths& values, const Place& place) const {
    Vec4* places[kClothCount] = {};
    for (uint32_t lane = 0; lane < count_; ++lane) places[lane] = place(particles_[lane]);
    StoreVectors(values, {places, count_}, 0);
  }

  uint32_t particles_[kClothCount];
  size_t count_;
};

// visit(ParticleBlock) of the particles that are added, in their order, as soon as they fill a
// block; the last ones by Finish.
template <class Visit>
class BlockQueue {
 public:
  explicit BlockQueue(const Visit& visit) : visit_(visit) {}
  void Add(uint32_t particle) {
    particles_[count_++] = particle;
    if (count_ == kClothCount) Finish();
  }
  void Finish() {
    if (count_ == 0) return;
    visit_(ParticleBlock({particles_, count_}));
    count_ = 0;
  }

 private:
  const Visit& visit_;
  uint32_t particles_[kClothCount];
  size_t count_ = 0;
};

// visit(block) of those particles that `are_looked_at(block)` says of blocks of all.
template <class AreLookedAt, class Visit>
HWY_INLINE void ForBlocks(std::span<const uint32_t> particles, const AreLookedAt& are_looked_at,
                          const Visit& visit) {
  BlockQueue<Visit> queue(visit);
  for (size_t begin = 0; begin < particles.size(); begin += kClothCount) {
    const ParticleBlock block(
        particles.subspan(begin, std::min<size_t>(kClothCount, particles.size() - begin)));
    ForLanes(are_looked_at(block), [&](uint32_t lane) { queue.Add(block.particle(lane)); });
  }
  queue.Finish();
}

}  // namespace
}  // namespace drape::cpu::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif  // include guard, once per instruction set
