// Sampled signed distance of a closed mesh: it makes any solid a collider (paper section 4.1).
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "server/core/interruption.h"
#include "server/core/status.h"
#include "server/scene/closed_mesh.h"
#include "server/scene/convex_polytope.h"
#include "server/scene/description.h"
#include "server/scene/surface_distance.h"

namespace drape {

// Resolution of the samples.
struct DistanceMapSettings {
  // Cells along the longest side of the mesh; 4 to 1024. By default 14 mm for a person of 1.8 m.
  uint32_t resolution = 128;
  // 4 bytes each. Cells grow until no more samples than this are needed; 1024 to 2^28.
  uint64_t max_samples = 1u << 21;
};

// Samples of the exact distance at the corners of cubic cells in the mesh's own frame, interpolated
// in between. A collider places the map by a rigid transform. Immutable; safe to share between
// threads.
//
// Error: |interpolated - exact| <= error_bound_m() everywhere in the grid, because the distances at
// two points differ by at most the distance between the points: with the weights w_k of the cell's
// corners x_k, the error is at most sum_k w_k |x_k - p| <= sqrt(sum_k w_k |x_k - p|^2) <= sqrt(3)/2
// cell. A spike that ends in the middle of a cell reaches it. At distance d from a smooth surface
// with principal curvatures below 1/R, it is at most 3/8 cell^2 / (R - |d|).
//
// Outside the grid, from q, the nearest point of the grid's box: sqrt(|p - q|^2 + D(q)^2). The mesh
// is inside the box, which is convex, so this is at most the exact distance (apart from the error
// bound) and at least 1/sqrt(2) of it. No contact is missed, and there is no jump at the box.
class DistanceMap {
 public:
  // Checks settings and mesh (closed_mesh.h) and refuses surfaces that cross themselves or have
  // parts inside out, as far as the samples show it. Fields: "mesh.positions_m[3]",
  // "mesh.triangles[7]", "resolution", "max_samples". Single threaded and slow, seconds rather than
  // milliseconds (distance_maps.md): not for a thread that others wait for. `interruption` is
  // asked before each layer of samples; null: nobody is.
  static Result<std::shared_ptr<const DistanceMap>> Build(const TriangleMesh& mesh,
                                                          const DistanceMapSettings& settings = {},
                                                          const ClosedMeshLimits& limits = {},
                                                          Interruption* interruption = nullptr);

  // Distance at a finite point in the mesh's frame.
  double DistanceAt(const Eigen::Vector3d& p) const;
  // With the normalised gradient of DistanceAt. On the faces between cells it is that of the cell
  // towards +; where it vanishes (length below kMinGradient: deep inside, halfway between two
  // surfaces) +Y.
  SurfaceDistance SurfaceAt(const Eigen::Vector3d& p) const;

  // |DistanceAt(p) - exact distance| in the grid's box; see above.
  double error_bound_m() const { return error_bound_m_; }
  double cell_m() const { return cell_m_; }
  // Of the deepest sample below the surface, 0 if there is none: at most half of the mesh's width
  // where it is widest.
  double depth_m() const { return depth_m_; }
  // The grid's box, which holds the mesh with a margin of kMarginCells.
  const Eigen::Vector3d& low_m() const { return low_m_; }
  Eigen::Vector3d high_m() const;
  // Samples along x, y and z, each >= 2.
  const std::array<uint32_t, 3>& sample_counts() const { return sample_counts_; }
  // Memory of the map, its mesh included [bytes].
  uint64_t size_bytes() const;
  // Sample (i, j, k), at low_m + cell_m * (i, j, k); x fastest, [count_z][count_y][count_x].
  std::span<const float> samples_m() const { return samples_m_; }
  // The mesh of the map: for drawing, and to compare.
  const TriangleMesh& mesh() const { return mesh_; }

  // Of what the mesh encloses.
  const SolidMoments& moments() const { return moments_; }
  // OutermostVertices of the mesh in kOutermostDirections.
  const std::vector<Eigen::Vector3d>& outermost_m() const { return outermost_m_; }

  // The solid itself, exactly, where it is convex and has few faces; else null.
  const std::shared_ptr<const ConvexPolytope>& polytope() const { return polytope_; }

  static constexpr int kMarginCells = 3;
  static constexpr int kOutermostDirections = 64;
  // Length of a gradient [-] below which its direction is rounding.
  static constexpr double kMinGradient = 1e-6;

 private:
  DistanceMap() = default;
  // The corner samples of a cell and the position of a point in it.
  struct CellPoint {
    std::array<double, 8> corners_m;  // bit 0 of the index: +x, bit 1: +y, bit 2: +z
    Eigen::Vector3d fraction;         // in [0, 1]
    Eigen::Vector3d outside_m;        // from the nearest point of the box to p
  };
  void SetGrid(const DistanceMapSettings& settings);
  void SetSamples(Interruption* interruption);
  std::optional<Eigen::Vector3d> FindContradiction() const;
  // Rounding of positions in double precision [m].
  double Rounding() const;
  size_t SampleIndex(uint32_t i, uint32_t j, uint32_t k) const {
    return (size_t{k} * sample_counts_[1] + j) * sample_counts_[0] + i;
  }
  Eigen::Vector3d SamplePoint(uint32_t i, uint32_t j, uint32_t k) const;
  CellPoint Locate(const Eigen::Vector3d& p) const;

  TriangleMesh mesh_;
  Eigen::Vector3d low_m_ = Eigen::Vector3d::Zero();
  double cell_m_ = 0;
  std::array<uint32_t, 3> sample_counts_{};
  std::vector<float> samples_m_;
  double error_bound_m_ = 0;
  double depth_m_ = 0;
  SolidMoments moments_;
  std::vector<Eigen::Vector3d> outermost_m_;
  std::shared_ptr<const ConvexPolytope> polytope_;
};

// Hash of all inputs of the map: equal arguments give equal maps and equal hashes.
uint64_t DistanceMapHash(const TriangleMesh& mesh, const DistanceMapSettings& settings);

// Whether two meshes are equal bit for bit.
bool SameContent(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace drape
