// Points by which a solid is tried against the surfaces of others. Pure.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "server/scene/colliders.h"

namespace drape::bodies {

// More: what a cylinder stands on is rounder; each is tried in every sweep [-].
inline constexpr int kRimPoints = 16;

// The circle around one end of a cylinder, as described.
struct Rim {
  Eigen::Vector3d centre_m;
  Eigen::Vector3d axis;  // unit
  Eigen::Vector3d side;  // unit, some direction across it
  double radius_m = 0;

  // Place k of kRimPoints evenly around it; the first one is where it goes farthest along
  // `direction`, or anywhere where it hardly goes farther than elsewhere.
  Eigen::Vector3d PlaceOf(int k, const Eigen::Vector3d& direction) const;
  void AddPlaces(const Eigen::Vector3d& direction, std::vector<Eigen::Vector3d>& places) const;
};

// The solid touches what is nearer to one of the points than the radius.
struct BodyPoints {
  std::vector<Eigen::Vector3d> places_m;  // as described; those of rims in turn
  double radius_m = 0;
  std::vector<Rim> rims;

  // The same with rims turned so that their first points are the nearest ones to a surface:
  // `downwards` gives the direction to it from a place, as described. Uses `turned`.
  template <class Downwards>
  const std::vector<Eigen::Vector3d>& PlacesTowards(const Downwards& downwards,
                                                    std::vector<Eigen::Vector3d>& turned) const {
    if (rims.empty()) return places_m;
    turned.clear();
    for (const Rim& rim : rims) {
      // From the centre, then from the point that is nearest from there: exact over a plane.
      const Eigen::Vector3d nearest = rim.PlaceOf(0, downwards(rim.centre_m));
      rim.AddPlaces(downwards(nearest), turned);
    }
    return turned;
  }
};

// A sphere's centre, the ends of a capsule, the corners of a box, the rims of a cylinder, the
// outermost vertices of a mesh; none of a plane. Edges between them are not seen; what is convex
// and simple does not touch by them (convex_pair.h).
BodyPoints PointsOf(const Collider& collider);

}  // namespace drape::bodies
