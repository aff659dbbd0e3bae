#include "server/solver/gl_compute/strip_lanes.h"

#include "server/solver/gl_compute/kernel_costs.h"
#include "shaders/interface/bindings.h"

namespace drape {

namespace {

uint32_t LinksOf(const StripSet& strips, uint32_t strip) {
  return strips.strip_offsets[strip + 1] - strips.strip_offsets[strip];
}

// Calls take(strip, first lane in the phase) for the strips of a phase in turn; the lanes of the
// phase. A strip begins the next group of lanes where it does not fit into the rest of this one.
template <typename Take>
uint32_t ForEachStrip(const StripSet& strips, uint32_t phase, Take take) {
  uint32_t lane = 0;
  for (uint32_t s = strips.phase_offsets[phase]; s < strips.phase_offsets[phase + 1]; ++s) {
    const uint32_t particles = LinksOf(strips, s) + 1;
    const uint32_t left = DRAPE_STRIP_LANES - lane % DRAPE_STRIP_LANES;
    if (particles > left) lane += left;
    take(s, lane);
    lane += particles;
  }
  return (lane + DRAPE_STRIP_LANES - 1) / DRAPE_STRIP_LANES * DRAPE_STRIP_LANES;
}

}  // namespace

bool FitsInLanes(const StripSet& strips) {
  return LongestStrip(strips) < DRAPE_STRIP_LANES;
}

StripLanes FindStripLanes(const StripSet& strips) {
  StripLanes lanes;
  lanes.phase_lanes.push_back(0);
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    const uint32_t first = lanes.phase_lanes.back();
    const auto take = [&](uint32_t strip, uint32_t lane) {
      const uint32_t links = LinksOf(strips, strip), place = strips.strip_offsets[strip];
      lanes.words.resize(DRAPE_STRIP_LANE_WORDS * (first + lane), 0);
      for (uint32_t k = 0; k <= links; ++k) {
        const uint32_t particle = strips.particles[place + strip + k];
        lanes.words.push_back(particle | k << 10 | links << 15);
        lanes.words.push_back(place + (k < links ? k : links - 1));
      }
    };
    lanes.phase_lanes.push_back(first + ForEachStrip(strips, phase, take));
    lanes.words.resize(DRAPE_STRIP_LANE_WORDS * lanes.phase_lanes.back(), 0);
  }
  return lanes;
}

std::vector<uint32_t> CountStripLanes(const StripSet& strips) {
  std::vector<uint32_t> counts;
  for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
    counts.push_back(ForEachStrip(strips, phase, [](uint32_t, uint32_t) {}));
  }
  return counts;
}

}  // namespace drape
