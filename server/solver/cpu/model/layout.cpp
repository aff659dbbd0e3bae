#include "server/solver/cpu/model/layout.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <vector>

#include "server/scene/content_hash.h"

namespace drape::cpu {
namespace {

template <class T>
bool AreSame(std::span<const T> a, std::span<const T> b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

// But for the stiffness, which clamps change.
bool AreSameElements(std::span<const ElasticElement> a, std::span<const ElasticElement> b) {
  return std::ranges::equal(a, b, [](const ElasticElement& x, const ElasticElement& y) {
    return x.particles == y.particles && x.weights == y.weights &&
           x.rest_length_m == y.rest_length_m && x.damping_share == y.damping_share;
  });
}

// The strips that begin with each constraint, in their order, and the phase of each strip. Sweeps
// that come back have some strips several times.
struct StripPlaces {
  explicit StripPlaces(const StripSet& strips)
      : strips_from(strips.constraints.size()), phase_of(strips.strip_count()) {
    for (uint32_t s = 0; s < strips.strip_count(); ++s) {
      strips_from[strips.constraints[strips.strip_offsets[s]]].push_back(s);
    }
    for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
      std::fill(phase_of.begin() + strips.phase_offsets[phase],
                phase_of.begin() + strips.phase_offsets[phase + 1], phase);
    }
  }

  std::vector<std::vector<uint32_t>> strips_from;
  std::vector<uint32_t> phase_of;
};

std::span<const uint32_t> LinksOf(const StripSet& strips, uint32_t strip) {
  return std::span(strips.constraints)
      .subspan(strips.strip_offsets[strip],
               strips.strip_offsets[strip + 1] - strips.strip_offsets[strip]);
}

std::span<const uint32_t> ParticlesOf(const StripSet& strips, uint32_t strip) {
  const size_t count = LinksOf(strips, strip).size() + 1;
  return std::span(strips.particles).subspan(strips.strip_offsets[strip] + strip, count);
}

// Whether the strips of both models are the same, and the layout solves those of each particle that
// `model` leaves free one after the other, in the order of `model`.
bool FitStrips(const SceneModel& model, const SceneModel& layout) {
  const StripSet &strips = model.strips(), &other = layout.strips();
  if (strips.strip_count() != other.strip_count()) return false;
  const StripPlaces places(other);
  const std::span<const double> w = model.inverse_masses_per_kg();
  // One more than the phase in the layout of the last strip of each particle so far.
  std::vector<uint32_t> next_phase(model.particle_count(), 0);
  std::vector<uint32_t> visits(other.constraints.size(), 0);  // of the strips from each constraint
  for (uint32_t s = 0; s < strips.strip_count(); ++s) {
    const uint32_t first = LinksOf(strips, s)[0];
    if (visits[first] == places.strips_from[first].size()) return false;
    const uint32_t same = places.strips_from[first][visits[first]++];
    if (!AreSame(LinksOf(strips, s), LinksOf(other, same)) ||
        !AreSame(ParticlesOf(strips, s), ParticlesOf(other, same))) {
      return false;
    }
    for (const uint32_t i : ParticlesOf(strips, s)) {
      if (w[i] == 0) continue;
      if (places.phase_of[same] < next_phase[i]) return false;
      next_phase[i] = places.phase_of[same] + 1;
    }
  }
  return true;
}

}  // namespace

bool FitsLayout(const SceneModel& model, const SceneModel& layout) {
  return AreSame(model.masses_kg(), layout.masses_kg()) &&
         AreSame(model.constraints(), layout.constraints()) &&
         AreSame(model.colour_offsets(), layout.colour_offsets()) &&
         AreSame(model.joints(), layout.joints()) && AreSame(model.springs(), layout.springs()) &&
         AreSameElements(model.elastic_elements(), layout.elastic_elements()) &&
         AreSame(model.triangles(), layout.triangles()) &&
         model.grid_columns() == layout.grid_columns() && model.grid_rows() == layout.grid_rows() &&
         FitStrips(model, layout);
}

uint64_t LayoutHash(const SceneModel& model) {
  ContentHash hash;
  const auto add = [&](auto values) { hash.Add(std::vector(values.begin(), values.end())); };
  add(model.masses_kg());
  add(model.constraints());
  add(model.joints());
  add(model.springs());
  add(model.triangles());
  hash.AddWord(model.elastic_elements().size());
  hash.AddWord(model.grid_columns());
  hash.AddWord(model.grid_rows());
  return hash.value();
}

}  // namespace drape::cpu
