#include "server/scene/colouring.h"

#include <algorithm>
#include <bit>

namespace drape {

namespace {

constexpr size_t kWordBits = 64;

// The first word of each particle's mask of used colours, [particle_count + 1]. When (i, j) is
// coloured, at most degree_i - 1 + degree_j - 1 colours are taken, so no colour of particle i
// exceeds degree_i - 2 + its largest neighbour's degree: masks of that size never overflow.
template <class Pair>
std::vector<size_t> MaskOffsets(std::span<const Pair> pairs, uint32_t particle_count) {
  std::vector<uint32_t> degrees(particle_count, 0);
  for (const Pair& pair : pairs) {
    ++degrees[pair.i];
    ++degrees[pair.j];
  }
  std::vector<uint32_t> neighbour_degrees(particle_count, 0);
  for (const Pair& pair : pairs) {
    neighbour_degrees[pair.i] = std::max(neighbour_degrees[pair.i], degrees[pair.j]);
    neighbour_degrees[pair.j] = std::max(neighbour_degrees[pair.j], degrees[pair.i]);
  }
  std::vector<size_t> offsets(particle_count + size_t{1}, 0);
  for (uint32_t p = 0; p < particle_count; ++p) {
    const size_t colours = size_t{degrees[p]} + neighbour_degrees[p];
    offsets[p + 1] = offsets[p] + (colours + kWordBits - 1) / kWordBits;
  }
  return offsets;
}

template <class Pair>
std::vector<uint32_t> ColourPairs(std::span<const Pair> pairs, uint32_t particle_count) {
  const std::vector<size_t> offsets = MaskOffsets(pairs, particle_count);
  std::vector<uint64_t> used(offsets.back(), 0);
  std::vector<uint32_t> colours;
  colours.reserve(pairs.size());
  for (const Pair& pair : pairs) {
    const uint32_t i = pair.i;
    const uint32_t j = pair.j;
    // A word that only one of the two masks has is unused by the other particle.
    const auto word_of = [&](uint32_t p, size_t word) {
      return offsets[p] + word < offsets[p + 1] ? used[offsets[p] + word] : 0;
    };
    size_t word = 0;
    while (~(word_of(i, word) | word_of(j, word)) == 0) ++word;
    const int bit = std::countr_one(word_of(i, word) | word_of(j, word));
    used[offsets[i] + word] |= uint64_t{1} << bit;
    used[offsets[j] + word] |= uint64_t{1} << bit;
    colours.push_back(static_cast<uint32_t>(word * kWordBits) + static_cast<uint32_t>(bit));
  }
  return colours;
}

}  // namespace

std::vector<uint32_t> ColourConstraints(std::span<const DistanceConstraint> constraints,
                                        uint32_t particle_count) {
  return ColourPairs(constraints, particle_count);
}

std::vector<uint32_t> ColourJoints(std::span<const PointJoint> joints, uint32_t particle_count) {
  return ColourPairs(joints, particle_count);
}

}  // namespace drape
