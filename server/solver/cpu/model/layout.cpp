#include "server/solver/cpu/model/layout.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <utility>
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

// The number of strips without those of ways back.
uint32_t StripsThere(const StripSet& strips) {
  return strips.phase_offsets[strips.phase_count_there];
}

// Ways back do not solve the phase again at which they turn, the first or the last.
std::pair<bool, bool> Turns(const StripSet& strips, uint32_t phase) {
  if (strips.phase_count() == strips.phase_count_there) return {};
  return {phase == 0, phase + 1 == strips.phase_count_there};
}

// The strip there of each constraint and the phase of each strip.
struct StripPlaces {
  explicit StripPlaces(const StripSet& strips)
      : strip_of(strips.constraints.size()), phase_of(strips.strip_count()) {
    for (uint32_t s = 0; s < StripsThere(strips); ++s) {
      for (uint32_t k = strips.strip_offsets[s]; k < strips.strip_offsets[s + 1]; ++k) {
        strip_of[strips.constraints[k]] = s;
      }
    }
    for (uint32_t phase = 0; phase < strips.phase_count(); ++phase) {
      std::fill(phase_of.begin() + strips.phase_offsets[phase],
                phase_of.begin() + strips.phase_offsets[phase + 1], phase);
    }
  }

  std::vector<uint32_t> strip_of;
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
  // Equal lengths of the lists: as many ways back, if the strips that turn are the same.
  if (StripsThere(strips) != StripsThere(other) || strips.strip_count() != other.strip_count()) {
    return false;
  }
  const StripPlaces own(strips), places(other);
  const std::span<const double> w = model.inverse_masses_per_kg();
  // One more than the phase in the layout of the last strip of each particle so far.
  std::vector<uint32_t> next_phase(model.particle_count(), 0);
  for (uint32_t s = 0; s < StripsThere(strips); ++s) {
    const uint32_t same = places.strip_of[LinksOf(strips, s)[0]];
    if (!AreSame(LinksOf(strips, s), LinksOf(other, same)) ||
        !AreSame(ParticlesOf(strips, s), ParticlesOf(other, same))) {
      return false;
    }
    if (Turns(strips, own.phase_of[s]) != Turns(other, places.phase_of[same])) return false;
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
