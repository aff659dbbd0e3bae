#include "server/scene/distance_map.h"

#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/core/violations.h"
#include "server/scene/content_hash.h"
#include "server/scene/mesh_distance.h"

namespace drape {
namespace {

using Eigen::Vector3d;

constexpr uint32_t kMinResolution = 4;
constexpr uint32_t kMaxResolution = 1024;
constexpr uint64_t kMinSamples = 1024;
constexpr uint64_t kMaxSamples = uint64_t{1} << 28;
// Share of a cell [-]: ten times the largest error that rounding to floats can add to the
// difference of two samples, the largest of which is below 2000 cells.
constexpr double kFloatSlack = 2e-3;

std::vector<FieldViolation> CheckSettings(const DistanceMapSettings& settings) {
  Violations violations;
  violations.CountInRange("resolution", settings.resolution, kMinResolution, kMaxResolution);
  violations.CountInRange("max_samples", settings.max_samples, kMinSamples, kMaxSamples);
  return violations.Take();
}

// Samples along each axis of a grid that holds a box of this size with its margin.
std::array<uint32_t, 3> SampleCounts(const Vector3d& size_m, double cell_m) {
  std::array<uint32_t, 3> counts;
  for (int axis = 0; axis < 3; ++axis) {
    // The slack keeps a box of whole cells from getting one more by rounding.
    const double cells = std::ceil(size_m[axis] / cell_m * (1 - 1e-12));
    counts[axis] = static_cast<uint32_t>(cells) + 2 * DistanceMap::kMarginCells + 1;
  }
  return counts;
}

uint64_t Product(const std::array<uint32_t, 3>& counts) {
  return uint64_t{counts[0]} * counts[1] * counts[2];
}

double Interpolate(const std::array<double, 8>& corners, const Vector3d& fraction) {
  const auto along = [](double a, double b, double t) { return a + t * (b - a); };
  const double y0z0 = along(corners[0], corners[1], fraction.x());
  const double y1z0 = along(corners[2], corners[3], fraction.x());
  const double y0z1 = along(corners[4], corners[5], fraction.x());
  const double y1z1 = along(corners[6], corners[7], fraction.x());
  return along(along(y0z0, y1z0, fraction.y()), along(y0z1, y1z1, fraction.y()), fraction.z());
}

// By the fractions; per cell. Along an axis: the interpolation, in the two others, of the
// differences of the corners.
Vector3d InterpolatedGradient(const std::array<double, 8>& corners, const Vector3d& fraction) {
  Vector3d gradient = Vector3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3;
    const int v = (axis + 2) % 3;
    for (int side = 0; side < 4; ++side) {
      const bool is_u = (side & 1) != 0;
      const bool is_v = (side & 2) != 0;
      const int from = (is_u << u) | (is_v << v);
      const double weight =
          (is_u ? fraction[u] : 1 - fraction[u]) * (is_v ? fraction[v] : 1 - fraction[v]);
      gradient[axis] += weight * (corners[from | (1 << axis)] - corners[from]);
    }
  }
  return gradient;
}

}  // namespace

Result<std::shared_ptr<const DistanceMap>> DistanceMap::Build(const TriangleMesh& mesh,
                                                              const DistanceMapSettings& settings,
                                                              const ClosedMeshLimits& limits,
                                                              Interruption* interruption) {
  auto violations = CheckSettings(settings);
  if (violations.empty()) violations = CheckClosedMesh(mesh, limits);
  if (!violations.empty()) return Status::InvalidFields(std::move(violations));
  const auto map = std::shared_ptr<DistanceMap>(new DistanceMap());
  map->mesh_ = mesh;
  map->SetGrid(settings);
  map->SetSamples(interruption);
  if (const auto contradiction = map->FindContradiction()) {
    const Vector3d& p = *contradiction;
    return Status::InvalidField(
        "mesh.triangles",
        fmt::format("inside and outside contradict each other near ({}, {}, {}) m: the surface "
                    "crosses itself or a part of it is inside out",
                    p.x(), p.y(), p.z()));
  }
  map->moments_ = MomentsOf(mesh);
  map->outermost_m_ = OutermostVertices(mesh, kOutermostDirections);
  map->polytope_ = PolytopeOf(mesh);
  return std::shared_ptr<const DistanceMap>(map);
}

// The mesh in the middle of the grid.
void DistanceMap::SetGrid(const DistanceMapSettings& settings) {
  Vector3d low = mesh_.positions_m[mesh_.triangles[0][0]];
  Vector3d high = low;
  for (const auto& triangle : mesh_.triangles) {
    for (const uint32_t vertex : triangle) {
      low = low.cwiseMin(mesh_.positions_m[vertex]);
      high = high.cwiseMax(mesh_.positions_m[vertex]);
    }
  }
  const Vector3d size = high - low;
  cell_m_ = size.maxCoeff() / settings.resolution;
  sample_counts_ = SampleCounts(size, cell_m_);
  while (Product(sample_counts_) > settings.max_samples) {
    cell_m_ *= 1.01;  // ends: a cell as long as the mesh leaves 8 samples along each axis
    sample_counts_ = SampleCounts(size, cell_m_);
  }
  const Vector3d grid_size =
      cell_m_ * Vector3d(sample_counts_[0] - 1, sample_counts_[1] - 1, sample_counts_[2] - 1);
  low_m_ = 0.5 * (low + high) - 0.5 * grid_size;
}

// Row by row there and back, so that each sample's nearest triangle is a good guess for the next.
void DistanceMap::SetSamples(Interruption* interruption) {
  const MeshDistance exact(mesh_);
  const auto [nx, ny, nz] = sample_counts_;
  samples_m_.resize(Product(sample_counts_));
  uint32_t guess = 0;
  float largest = 0, lowest = 0;
  for (uint32_t k = 0; k < nz; ++k) {
    Ask(interruption);
    for (uint32_t row = 0; row < ny; ++row) {
      const uint32_t j = k % 2 == 0 ? row : ny - 1 - row;
      for (uint32_t step = 0; step < nx; ++step) {
        const uint32_t i = row % 2 == 0 ? step : nx - 1 - step;
        const SignedDistance distance = exact.At(SamplePoint(i, j, k), guess);
        guess = distance.triangle;
        const auto sample = static_cast<float>(distance.distance_m);
        samples_m_[SampleIndex(i, j, k)] = sample;
        largest = std::max(largest, std::abs(sample));
        lowest = std::min(lowest, sample);
      }
    }
  }
  depth_m_ = -static_cast<double>(lowest);
  // Storing as floats costs half a unit in the last place of the largest sample.
  error_bound_m_ = 0.5 * std::sqrt(3.0) * cell_m_ + Rounding() +
                   0.5 * static_cast<double>(largest * std::numeric_limits<float>::epsilon());
}

// Distances of neighbouring samples differ by at most their spacing; where the sign is wrong on one
// side of a place that is not next to the surface, they do not. Returns that place.
std::optional<Vector3d> DistanceMap::FindContradiction() const {
  const double largest_step = (1 + kFloatSlack) * cell_m_ + Rounding();
  const std::array<size_t, 3> strides = {1, sample_counts_[0],
                                         size_t{sample_counts_[0]} * sample_counts_[1]};
  size_t index = 0;
  for (uint32_t k = 0; k < sample_counts_[2]; ++k) {
    for (uint32_t j = 0; j < sample_counts_[1]; ++j) {
      for (uint32_t i = 0; i < sample_counts_[0]; ++i, ++index) {
        const std::array<uint32_t, 3> at = {i, j, k};
        const double sample = samples_m_[index];
        for (int axis = 0; axis < 3; ++axis) {
          if (at[axis] + 1 == sample_counts_[axis]) continue;
          const double step = samples_m_[index + strides[axis]] - sample;
          if (!(std::abs(step) <= largest_step)) return SamplePoint(i, j, k);
        }
      }
    }
  }
  return std::nullopt;
}

double DistanceMap::Rounding() const {
  const double farthest = low_m_.cwiseAbs().cwiseMax(high_m().cwiseAbs()).maxCoeff();
  return 16 * std::numeric_limits<double>::epsilon() * farthest;
}

uint64_t DistanceMap::size_bytes() const {
  return sizeof(*this) + samples_m_.size() * sizeof(float) +
         mesh_.positions_m.size() * sizeof(Vector3d) +
         mesh_.triangles.size() * sizeof(mesh_.triangles[0]) +
         (polytope_ ? polytope_->size_bytes() : 0);
}

Vector3d DistanceMap::high_m() const {
  return SamplePoint(sample_counts_[0] - 1, sample_counts_[1] - 1, sample_counts_[2] - 1);
}

Vector3d DistanceMap::SamplePoint(uint32_t i, uint32_t j, uint32_t k) const {
  return low_m_ + cell_m_ * Vector3d(i, j, k);
}

DistanceMap::CellPoint DistanceMap::Locate(const Vector3d& p) const {
  CellPoint located;
  std::array<uint32_t, 3> cell;
  for (int axis = 0; axis < 3; ++axis) {
    const double in_cells = (p[axis] - low_m_[axis]) / cell_m_;
    const auto last = static_cast<double>(sample_counts_[axis] - 1);
    // In this order NaN becomes 0, and the index stays legal.
    const double clamped = std::min(std::max(0.0, in_cells), last);
    cell[axis] = std::min(static_cast<uint32_t>(clamped), sample_counts_[axis] - 2);
    located.fraction[axis] = clamped - cell[axis];
    located.outside_m[axis] = (in_cells - clamped) * cell_m_;
  }
  for (uint32_t corner = 0; corner < 8; ++corner) {
    located.corners_m[corner] = samples_m_[SampleIndex(
        cell[0] + (corner & 1), cell[1] + ((corner >> 1) & 1), cell[2] + (corner >> 2))];
  }
  return located;
}

double DistanceMap::DistanceAt(const Vector3d& p) const {
  const CellPoint located = Locate(p);
  const double inside = Interpolate(located.corners_m, located.fraction);
  const double outside_sq = located.outside_m.squaredNorm();
  return outside_sq == 0 ? inside : std::sqrt(inside * inside + outside_sq);
}

SurfaceDistance DistanceMap::SurfaceAt(const Vector3d& p) const {
  const CellPoint located = Locate(p);
  const double inside = Interpolate(located.corners_m, located.fraction);
  Vector3d gradient = InterpolatedGradient(located.corners_m, located.fraction) / cell_m_;
  const double outside_sq = located.outside_m.squaredNorm();
  double distance = inside;
  if (outside_sq != 0) {
    // The box's nearest point moves with p only along the axes on which p is within.
    distance = std::sqrt(inside * inside + outside_sq);
    for (int axis = 0; axis < 3; ++axis) {
      const double outside = located.outside_m[axis];
      gradient[axis] = (outside == 0 ? inside * gradient[axis] : outside) / distance;
    }
  }
  const double length = gradient.norm();
  return {.distance_m = distance,
          .outward = length < kMinGradient ? Vector3d::UnitY() : Vector3d(gradient / length)};
}

uint64_t DistanceMapHash(const TriangleMesh& mesh, const DistanceMapSettings& settings) {
  ContentHash hash;
  hash.Add(mesh.positions_m);
  hash.Add(mesh.triangles);
  hash.AddWord(settings.resolution);
  hash.AddWord(settings.max_samples);
  return hash.value();
}

bool SameContent(const TriangleMesh& a, const TriangleMesh& b) {
  return SameBits(a.positions_m, b.positions_m) && SameBits(a.triangles, b.triangles);
}

}  // namespace drape
