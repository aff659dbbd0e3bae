#include "server/scheduler/grabbed_positions.h"

#include <algorithm>
#include <map>
#include <set>
#include <utility>

#include "server/scheduler/grip_track.h"

namespace drape {
namespace {

// Most particles of a read that serves several cloths: more of them make fewer reads, which a GPU
// has to wait for, and more rows that nobody wants.
constexpr size_t kMaxParticlesPerRead = 64;

}  // namespace

bool Grabs(const GripControl& control) {
  return control.action == GripAction::kGrabParticle || control.action == GripAction::kGrabNearest;
}

GrabbedPositions::GrabbedPositions(Backend& backend,
                                   std::span<const ClothControl<GripControl>> controls,
                                   std::span<const std::shared_ptr<ClothRuntime>> cloths) {
  struct Wanted {
    bool is_whole = false;
    std::set<uint32_t> particles;
  };
  std::map<uint32_t, Wanted> wanted;  // by cloth
  for (const auto& [k, control] : controls) {
    if (!Grabs(control)) continue;
    Wanted& its = wanted[k];
    its.is_whole |= control.action == GripAction::kGrabNearest;
    if (control.action == GripAction::kGrabParticle) its.particles.insert(control.particle);
  }
  std::vector<uint32_t> whole;
  std::map<uint32_t, std::vector<uint32_t>> by_size;  // a read is of particles that all have
  for (const auto& [k, its] : wanted) {
    (its.is_whole ? whole : by_size[cloths[k]->particle_count()]).push_back(k);
  }
  if (!whole.empty()) Read(backend, cloths, whole, {});
  for (const auto& [size, indices] : by_size) {
    std::set<uint32_t> together;
    size_t begin = 0;
    for (size_t end = 0; end < indices.size(); ++end) {
      const std::set<uint32_t>& its = wanted.at(indices[end]).particles;
      const auto more = static_cast<size_t>(
          std::ranges::count_if(its, [&](uint32_t p) { return !together.contains(p); }));
      if (end > begin && together.size() + more > kMaxParticlesPerRead) {
        Read(backend, cloths, std::span(indices).subspan(begin, end - begin),
             {together.begin(), together.end()});
        together.clear();
        begin = end;
      }
      together.insert(its.begin(), its.end());
    }
    Read(backend, cloths, std::span(indices).subspan(begin), {together.begin(), together.end()});
  }
}

void GrabbedPositions::Read(Backend& backend, std::span<const std::shared_ptr<ClothRuntime>> cloths,
                            std::span<const uint32_t> indices, std::vector<uint32_t> particles) {
  auto& rows = *reads_.emplace_back(std::make_unique<Rows>());
  rows.particles = std::move(particles);
  std::vector<ClothHandle> handles;
  size_t row = 0;
  for (const uint32_t k : indices) {
    handles.push_back(cloths[k]->handle());
    places_.emplace(k, Place{&rows, row});
    row += RowsOf(rows.particles, cloths[k]->particle_count());
  }
  rows.state = backend.Read({.cloths = handles, .particles = rows.particles});
}

std::optional<uint32_t> GrabbedPositions::GrabbedBy(const ClothControl<GripControl>& control,
                                                    const ClothRuntime& cloth) const {
  const GripControl& its = control.control;
  if (its.action == GripAction::kGrabNearest) {
    const Place& place = places_.at(control.cloth_index);
    return NearestLoose(*cloth.model(), cloth.controls().grips(), place.rows->state.positions_m,
                        place.first_row, its.place_m, its.radius_m);
  }
  // It may have become a pin since the request came.
  if (cloth.model()->inverse_masses_per_kg()[its.particle] == 0) return std::nullopt;
  return its.particle;
}

Eigen::Vector3d GrabbedPositions::PositionOf(uint32_t cloth_index, uint32_t particle) const {
  const auto& [rows, first_row] = places_.at(cloth_index);
  size_t row = particle;
  if (!rows->particles.empty()) {
    const auto found = std::ranges::lower_bound(rows->particles, particle);
    row = static_cast<size_t>(found - rows->particles.begin());
  }
  return VectorAt(rows->state.positions_m, first_row + row);
}

}  // namespace drape
