// Where two convex solids touch. Pure.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "server/scene/rigid_motion.h"
#include "server/scene/surface_distance.h"
#include "server/solver/bodies/body_points.h"
#include "server/solver/bodies/convex_solid.h"
#include "server/solver/bodies/placed_collider.h"

namespace drape::bodies {

// A direction that goes along with one of two solids, or is perpendicular to one of each.
struct PairAxis {
  enum class Kind { kOfFirst, kOfSecond, kAcross };

  Kind kind = Kind::kOfFirst;
  Eigen::Vector3d of_first = Eigen::Vector3d::Zero();   // as described
  Eigen::Vector3d of_second = Eigen::Vector3d::Zero();  // as described
  double sign = 1;

  // Unit; zero where the two directions of kAcross are parallel.
  Eigen::Vector3d At(const RigidMotion& first, const RigidMotion& second) const;
};

// A place of the first solid over one of the second; the surfaces are `round_m` nearer.
struct PairSpot {
  Eigen::Vector3d on_first;   // as described
  Eigen::Vector3d on_second;  // as described
  double round_of_first_m = 0;
  double round_of_second_m = 0;
  // The same for the same corner, or crossing of edges, as long as the same parts touch.
  int name = 0;
};

// Two solids that each are all on one side of a plane touch along its normal: the axis along which
// they overlap least of those that the shapes suggest (the separating-axis test: Gottschalk, Lin
// and Manocha 1996; for flat faces it is exact). They touch where their outlines in the plane
// overlap, face on face, corner on face or edge over edge, at the corners of that.
class ConvexPair {
 public:
  ConvexPair(const ConvexSolid& first, const ConvexSolid& second)
      : first_(first), second_(second) {}

  // Most spots that two such solids have.
  size_t most_spots() const;
  // Finds the axis and the spots where they are at the end of the substep, if they are less than
  // `near_m` apart there along every axis. Where they are apart by more than `slack_m` as it
  // starts, the axis is the one along which they come together last, so that nothing thin is
  // passed through. `points_of_...`: as PointsOf.
  void FindSpots(const PlacedCollider& first, const PlacedCollider& second,
                 const BodyPoints& points_of_first, const BodyPoints& points_of_second,
                 double near_m, double slack_m);
  // None before the first FindSpots.
  const std::vector<PairSpot>& spots() const { return spots_; }
  // Which parts of the solids the spots are of.
  int parts() const { return parts_; }
  // The distance of the surfaces at a spot along the axis, which leads out of the second solid.
  SurfaceDistance GapAt(const PairSpot& spot, const RigidMotion& first,
                        const RigidMotion& second) const;

 private:
  class AxisSearch;

  std::vector<PairAxis> RoundAxes(const PlacedCollider& first, const PlacedCollider& second,
                                  const BodyPoints& points_of_first,
                                  const BodyPoints& points_of_second) const;
  void AddSpots(const RigidMotion& first, const RigidMotion& second, const Eigen::Vector3d& n,
                double separation_m);

  ConvexSolid first_;
  ConvexSolid second_;
  PairAxis axis_;
  std::vector<PairSpot> spots_;
  int parts_ = 0;
};

}  // namespace drape::bodies
