// Random cloths and random requests about them, the same on every machine.
#pragma once

#include <cstdint>
#include <random>
#include <string>

#include "tests/system/calls.h"

namespace drape::test {

class RandomTraffic {
 public:
  // `may_touch_itself`: the backend has self-collision.
  RandomTraffic(uint32_t seed, bool may_touch_itself)
      : random_(seed), seed_(seed), may_touch_itself_(may_touch_itself) {}

  // Three cloths that differ in gravity alone: by turns sheets with springs, with bending, among
  // moving colliders with friction and restitution, touching themselves, gripped, that soon sleep,
  // chains with driven lengths, and meshes.
  v1::CreateClothsRequest Creation(const std::string& session);
  // One to eight measured steps of all of them with random controls.
  v1::StepRequest Steps(const std::string& session, const Ids& ids);
  // Changes parameters, pins, model, state and controls of the cloths.
  void Disturb(Stub& stub, const std::string& session, const Ids& ids);
  // The part of a request that is about `cloth`, asked of `instead`.
  static v1::StepRequest OnlyFor(const v1::StepRequest& request, uint64_t cloth, uint64_t instead);

 private:
  enum Kind { kSprings, kBending, kColliders, kSelf, kGrips, kSleep, kChain, kMesh, kKinds };

  double Real(double least, double most) {
    return least + (most - least) * (static_cast<double>(random_() >> 8) / (1u << 24));
  }
  uint32_t Below(uint32_t count) { return static_cast<uint32_t>(random_() % count); }
  Kind kind() const { return static_cast<Kind>(seed_ % kKinds); }
  void DescribeSheet(v1::ClothSpec& spec);
  void AddColliders(v1::ClothSpec& spec);
  static void DescribeChain(v1::ClothSpec& spec);
  static void DescribeMesh(v1::ClothSpec& spec);

  std::mt19937 random_;
  uint32_t seed_;
  bool may_touch_itself_;
  uint32_t particles_ = 0;
};

// Everything of an answer but its times.
std::string AnswerText(v1::StepResponse answer);
}  // namespace drape::test
