#include "server/solver/gl_compute/strip_lanes.h"

#include <algorithm>
#include <array>
#include <span>

#include "server/solver/gl_compute/kernel_costs.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

// On an H200 lanes of more than one particle are faster for larger cloths, whose work group has a
// multiprocessor to itself. Small cloths share one, and the larger kernel leaves room for fewer of
// them (tests/bench/notes/gl.md).
constexpr uint32_t kMostParticlesOfSingles = 512;

uint32_t LinksOf(const StripSet& strips, uint32_t strip) {
  return strips.strip_offsets[strip + 1] - strips.strip_offsets[strip];
}

// Calls take(strip, first lane in the phase) for the strips of a phase in turn; the lanes of the
// phase. A strip begins the next group of lanes where it does not fit into the rest of this one.
template <typename Take>
uint32_t ForEachStrip(const SceneModel& model, uint32_t phase, Take take) {
  const StripSet& strips = model.strips();
  const uint32_t particles_per_lane = HasLaneQuads(model) ? 4 : 1;
  uint32_t lane = 0;
  for (uint32_t s = strips.phase_offsets[phase]; s < strips.phase_offsets[phase + 1]; ++s) {
    const uint32_t lanes = LinksOf(strips, s) / particles_per_lane + 1;
    const uint32_t left = DRAPE_STRIP_LANES - lane % DRAPE_STRIP_LANES;
    if (lanes > left) lane += left;
    take(s, lane);
    lane += lanes;
  }
  return (lane + DRAPE_STRIP_LANES - 1) / DRAPE_STRIP_LANES * DRAPE_STRIP_LANES;
}

// `place`: of the first link in the lists of links.
void AppendSingles(std::span<const uint32_t> particles, uint32_t links, uint32_t place,
                   std::vector<uint32_t>& words) {
  for (uint32_t k = 0; k <= links; ++k) {
    words.push_back(particles[k] | k << 10 | links << 15);
    words.push_back(place + std::min(k, links - 1));
  }
}

// The lanes end with the last particle.
void AppendQuads(std::span<const uint32_t> particles, uint32_t links, uint32_t place,
                 std::vector<uint32_t>& words) {
  const uint32_t last_lane = links / 4;
  const uint32_t missing = 3 - links % 4;  // particles of the first lane
  for (uint32_t lane = 0; lane <= last_lane; ++lane) {
    std::array<uint32_t, 4> of_lane;
    for (uint32_t k = 0; k < 4; ++k) {
      of_lane[k] = particles[std::max(4 * lane + k, missing) - missing];
    }
    words.push_back(of_lane[0] | of_lane[1] << 10 | of_lane[2] << 20);
    const uint32_t end = 4 * lane + 4 - missing;  // of its particles in the strip
    words.push_back(of_lane[3] | end << 10 | last_lane << 16 | place << 19);
  }
}

}  // namespace

bool HasLaneQuads(const SceneModel& model) {
  return model.particle_count() > kMostParticlesOfSingles;
}

bool FitsInLanes(const SceneModel& model) {
  // Pairs would have room for twice as many, but reduction errs more than elimination: chains of 34
  // links and more, of masses 1 : 1000, went astray.
  return LongestStrip(model.strips()) < DRAPE_STRIP_LANES;
}

StripLanes FindStripLanes(const SceneModel& model) {
  const StripSet& strips = model.strips();
  StripLanes lanes;
  lanes.phase_lanes.push_back(0);
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    const uint32_t first = lanes.phase_lanes.back();
    const auto take = [&](uint32_t strip, uint32_t lane) {
      const auto place = static_cast<uint32_t>(strips.strip_offsets[strip]);
      const auto particles = std::span<const uint32_t>(strips.particles).subspan(place + strip);
      lanes.words.resize(DRAPE_STRIP_LANE_WORDS * (first + lane), 0);
      const auto append = HasLaneQuads(model) ? AppendQuads : AppendSingles;
      append(particles, LinksOf(strips, strip), place, lanes.words);
    };
    lanes.phase_lanes.push_back(first + ForEachStrip(model, phase, take));
    lanes.words.resize(DRAPE_STRIP_LANE_WORDS * lanes.phase_lanes.back(), 0);
  }
  return lanes;
}

std::vector<uint32_t> CountStripLanes(const SceneModel& model) {
  std::vector<uint32_t> counts;
  for (uint32_t phase = 0; phase < model.strips().phase_count(); ++phase) {
    counts.push_back(ForEachStrip(model, phase, [](uint32_t, uint32_t) {}));
  }
  return counts;
}

}  // namespace drape
