// On which side of a plane a point lies, exactly.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace drape::self_contact {

// The sign, -1, 0 or 1, of (b - a) x (c - a) . (d - a), exact for all finite coordinates whose
// products neither overflow nor underflow (1e-40 to 1e40 m are far from both).
int Orientation(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c,
                const Eigen::Vector3d& d);

// Whether the edge from p to q goes through the triangle a b c: its ends lie strictly on different
// sides of the plane, and its line meets the triangle or its border. Exact.
bool Crosses(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c);
// The same; adds to `exact` how many signs were hidden by rounding and took a hundred times as
// long.
bool Crosses(const Eigen::Vector3d& p, const Eigen::Vector3d& q, const Eigen::Vector3d& a,
             const Eigen::Vector3d& b, const Eigen::Vector3d& c, uint32_t& exact);

}  // namespace drape::self_contact
