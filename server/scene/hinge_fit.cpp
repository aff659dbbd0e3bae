#include "server/scene/hinge_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

namespace drape {
namespace {

using Eigen::Vector3d;

// Rounds of letting vertices give way and fitting; more change little.
constexpr int kRounds = 2;
// Steps of conjugate gradients. Vertices give way within as many edges, so to the pattern of the
// triangles and not to the shape of the cloth.
constexpr int kYieldSteps = 8;
constexpr int kFitSteps = 8;
// How much it counts that a hinge stays as it is, beside the errors of its patches [-]. Larger: the
// pattern shines through; smaller: hinges that no patch needs go to the limits.
constexpr double kStay = 0.05;
// Root of the mean square, over all directions, of the error that the fit leaves in a patch [-]: up
// to the first it is taken, beyond the second not at all. Right triangles that are cut alike have
// 0.45, whatever the stiffness of their hinges; other patterns up to 0.2.
constexpr double kGoodError = 0.25;
constexpr double kBadError = 0.4;
constexpr double kLeastFactor = 0.1;
constexpr double kLargestFactor = 3;

// What a hinge or a vertex makes of a curvature S, a symmetric tensor: T : S, T = xx, yy, zz, xy,
// xz, yz.
using Response = Eigen::Array<double, 6, 1>;
// Energy of curves by their direction over that of the plate: its mean, then the cosines and sines
// of twice and four times the angle, by their root of the mean square.
using Energy = Eigen::Array<double, 5, 1>;

Response Product(const Vector3d& a, const Vector3d& b) {
  return {a.x() * b.x(),
          a.y() * b.y(),
          a.z() * b.z(),
          (a.x() * b.y() + a.y() * b.x()) / 2,
          (a.x() * b.z() + a.z() * b.x()) / 2,
          (a.y() * b.z() + a.z() * b.y()) / 2};
}

double Between(const Vector3d& a, const Response& t, const Vector3d& b) {
  return a.x() * (t[0] * b.x() + t[3] * b.y() + t[4] * b.z()) +
         a.y() * (t[3] * b.x() + t[1] * b.y() + t[5] * b.z()) +
         a.z() * (t[4] * b.x() + t[5] * b.y() + t[2] * b.z());
}

double InnerProduct(const Response& a, const Response& b) {
  return (a * b).head<3>().sum() + 2 * (a * b).tail<3>().sum();
}

struct Frame {
  Vector3d x = Vector3d::Zero();  // in the sheet, as y
  Vector3d y = Vector3d::Zero();
  Vector3d normal = Vector3d::Zero();
};

// How an energy in one frame is seen in another, which the sheet is turned into.
class Turn {
 public:
  Turn(const Frame& from, const Frame& to) {
    const double x = from.x.dot(to.x), y = from.x.dot(to.y);
    const double length_sq = std::max(x * x + y * y, 1e-12);
    cos2_ = (x * x - y * y) / length_sq;
    sin2_ = 2 * x * y / length_sq;
    mirror_ = from.normal.dot(to.normal) < 0 ? -1 : 1;
  }

  Energy operator()(const Energy& e) const {
    return Rotated({e[0], e[1], mirror_ * e[2], e[3], mirror_ * e[4]}, sin2_);
  }
  Energy Back(const Energy& e) const {
    const Energy r = Rotated(e, -sin2_);
    return {r[0], r[1], mirror_ * r[2], r[3], mirror_ * r[4]};
  }

 private:
  Energy Rotated(const Energy& e, double sin2) const {
    const double cos4 = cos2_ * cos2_ - sin2 * sin2, sin4 = 2 * cos2_ * sin2;
    return {e[0], e[1] * cos2_ - e[2] * sin2, e[1] * sin2 + e[2] * cos2_, e[3] * cos4 - e[4] * sin4,
            e[3] * sin4 + e[4] * cos4};
  }

  double cos2_, sin2_, mirror_;
};

class HingeFit {
 public:
  HingeFit(std::span<const Vector3d> positions_m, std::span<const ElasticElement> hinges,
           double rigidity_n_m)
      : hinges_(hinges), factors_(hinges.size(), 1.0), vertices_(positions_m.size()) {
    for (const ElasticElement& hinge : hinges) {
      areas_.push_back(rigidity_n_m / hinge.stiffness_n_per_m);
      PlaceHinge(positions_m, hinge);
    }
    PlaceVertices();
    FindRim();
  }

  std::vector<double> Solve(Interruption* interruption) {
    energies_.resize(hinges_.size());
    for (int round = 0; round < kRounds; ++round) {
      LetYield(interruption);
      FindEnergies();
      Fit(interruption);
    }
    KeepWhereBad(interruption);
    return factors_;
  }

 private:
  using Responses = std::vector<Response>;
  using Energies = std::vector<Energy>;
  struct Vertex {
    Frame frame;
    double area = 0;
    double ring_area = 0;
    bool is_inner = false;  // more than two edges from the rim
  };

  // Flat: what is folded is unfolded about its edge.
  void PlaceHinge(std::span<const Vector3d> positions_m, const ElasticElement& hinge) {
    const auto& [i, j, k, l] = hinge.particles;
    const auto& weights = hinge.weights;
    const Vector3d edge = positions_m[j] - positions_m[i];
    const double length = edge.norm();
    const Vector3d up = edge.cross(positions_m[k] - positions_m[i]).normalized();
    const Vector3d down = (positions_m[l] - positions_m[i]).cross(edge).normalized();
    Frame frame{.x = edge / length};
    frame.normal = up + down;
    if (frame.normal.squaredNorm() < 1e-12) frame.normal = up;
    frame.normal = frame.normal.normalized();
    frame.y = frame.normal.cross(frame.x);
    Response curve = weights[1] * length * length / 2 * Product(frame.x, frame.x);
    for (const size_t place : {size_t{2}, size_t{3}}) {
      const Vector3d side = positions_m[hinge.particles[place]] - positions_m[i];
      const double along = side.dot(frame.x);
      const double across = (side - along * frame.x).norm() * (place == 2 ? 1 : -1);
      const Vector3d flat = along * frame.x + across * frame.y;
      curve += weights[place] / 2 * Product(flat, flat);
    }
    frames_.push_back(frame);
    curves_.push_back(curve);
  }

  void PlaceVertices() {
    for (size_t h = 0; h < hinges_.size(); ++h) {
      const Frame& frame = frames_[h];
      for (const size_t end : {0, 1}) {
        Vertex& vertex = vertices_[hinges_[h].particles[end]];
        const double sign = vertex.frame.normal.dot(frame.normal) < 0 ? -1 : 1;
        vertex.frame.normal += sign * areas_[h] * frame.normal;
        vertex.area += areas_[h] / 6;
        vertex.frame.x = frame.x;
      }
    }
    for (auto& [frame, area, ring_area, is_inner] : vertices_) {
      if (area == 0) continue;
      frame.normal.normalize();
      frame.y = frame.normal.cross(frame.x).normalized();
      frame.x = frame.y.cross(frame.normal);
    }
  }

  template <class Visit>  // visit(vertex, neighbour), both ways
  void ForSpokes(const Visit& visit) const {
    for (const ElasticElement& hinge : hinges_) {
      visit(hinge.particles[0], hinge.particles[1]);
      visit(hinge.particles[1], hinge.particles[0]);
    }
  }

  // A ring is complete where every side of every triangle at the vertex has a hinge.
  void FindRim() {
    const auto pair = [](uint32_t v, uint32_t u) {
      return std::array<uint32_t, 2>{std::min(v, u), std::max(v, u)};
    };
    std::vector<std::array<uint32_t, 2>> edges;
    for (const ElasticElement& hinge : hinges_) {
      edges.push_back(pair(hinge.particles[0], hinge.particles[1]));
    }
    std::ranges::sort(edges);
    std::vector<bool> is_rim(vertices_.size(), false);
    for (const ElasticElement& hinge : hinges_) {
      for (const size_t apex : {2, 3}) {
        for (const size_t end : {0, 1}) {
          const auto side = pair(hinge.particles[apex], hinge.particles[end]);
          if (!std::ranges::binary_search(edges, side)) is_rim[side[0]] = is_rim[side[1]] = true;
        }
      }
    }
    for (size_t v = 0; v < vertices_.size(); ++v) {
      vertices_[v].is_inner = !is_rim[v] && vertices_[v].area > 0;
      vertices_[v].ring_area = vertices_[v].area;
    }
    ForSpokes([&](uint32_t v, uint32_t u) {
      vertices_[v].ring_area += vertices_[u].area;
      if (is_rim[u]) vertices_[v].is_inner = false;
    });
    std::vector<bool> is_far(vertices_.size());
    for (size_t v = 0; v < vertices_.size(); ++v) is_far[v] = vertices_[v].is_inner;
    ForSpokes([&](uint32_t v, uint32_t u) {
      if (!is_far[u]) vertices_[v].is_inner = false;
    });
  }

  double Stiffness(size_t h) const { return factors_[h] / areas_[h]; }

  // What the vertices give way to a curve, by a few steps of conjugate gradients from 0.
  void LetYield(Interruption* interruption) {
    const size_t count = vertices_.size();
    std::vector<double> pivots(count, 0.0);
    Responses rest(count, Response::Zero());
    for (size_t h = 0; h < hinges_.size(); ++h) {
      for (size_t k = 0; k < 4; ++k) {
        const double pull = Stiffness(h) * hinges_[h].weights[k];
        pivots[hinges_[h].particles[k]] += pull * hinges_[h].weights[k];
        rest[hinges_[h].particles[k]] -= pull * curves_[h];
      }
    }
    const auto solve = [&](size_t v) -> Response {
      if (!vertices_[v].is_inner || pivots[v] == 0) return Response::Zero();
      return rest[v] / pivots[v];
    };
    yields_.assign(count, Response::Zero());
    Responses way(count, Response::Zero()), pull(count);
    double size = 0;
    for (int step = 0; step < kYieldSteps; ++step) {
      Ask(interruption);
      double new_size = 0;
      for (size_t v = 0; v < count; ++v) new_size += InnerProduct(rest[v], solve(v));
      const double keep = step == 0 ? 0 : new_size / size;
      size = new_size;
      for (size_t v = 0; v < count; ++v) way[v] = solve(v) + keep * way[v];
      double work = 0;
      std::fill(pull.begin(), pull.end(), Response::Zero());
      for (size_t h = 0; h < hinges_.size(); ++h) {
        const Response bend = Bend(h, way);
        work += Stiffness(h) * InnerProduct(bend, bend);
        for (size_t k = 0; k < 4; ++k) {
          pull[hinges_[h].particles[k]] += Stiffness(h) * hinges_[h].weights[k] * bend;
        }
      }
      if (!(work > 0)) return;
      for (size_t v = 0; v < count; ++v) {
        yields_[v] += size / work * way[v];
        rest[v] -= size / work * pull[v];
      }
    }
  }

  Response Bend(size_t h, const Responses& ways) const {
    Response bend = Response::Zero();
    for (size_t k = 0; k < 4; ++k) bend += hinges_[h].weights[k] * ways[hinges_[h].particles[k]];
    return bend;
  }

  void FindEnergies() {
    for (size_t h = 0; h < hinges_.size(); ++h) {
      const Frame& frame = frames_[h];
      const Response bend = curves_[h] + Bend(h, yields_);
      const double xx = Between(frame.x, bend, frame.x), yy = Between(frame.y, bend, frame.y);
      const double a = (xx + yy) / 2, b = (xx - yy) / 2, c = Between(frame.x, bend, frame.y);
      constexpr double kRoot = std::numbers::sqrt2 / 2;
      energies_[h] = {a * a + (b * b + c * c) / 2, 2 * kRoot * a * b, 2 * kRoot * a * c,
                      kRoot / 2 * (b * b - c * c), kRoot * b * c};
      energies_[h] /= areas_[h];
    }
  }

  // Of the patches: rings of vertices, by their area.
  Energies OfPatches(const std::vector<double>& factors) const {
    Energies of_vertices(vertices_.size(), Energy::Zero());
    for (size_t h = 0; h < hinges_.size(); ++h) {
      for (size_t k = 0; k < 2; ++k) {
        const uint32_t v = hinges_[h].particles[k];
        of_vertices[v] += factors[h] / 2 * Turn(frames_[h], vertices_[v].frame)(energies_[h]);
      }
    }
    Energies of_patches = of_vertices;
    ForSpokes([&](uint32_t v, uint32_t u) {
      of_patches[v] += Turn(vertices_[u].frame, vertices_[v].frame)(of_vertices[u]);
    });
    for (size_t v = 0; v < vertices_.size(); ++v) {
      of_patches[v] *= vertices_[v].is_inner ? 1 / vertices_[v].ring_area : 0;
    }
    return of_patches;
  }

  // The transposed.
  std::vector<double> OfHinges(Energies of_patches) const {
    for (size_t v = 0; v < vertices_.size(); ++v) {
      of_patches[v] *= vertices_[v].is_inner ? 1 / vertices_[v].ring_area : 0;
    }
    Energies of_vertices = of_patches;
    ForSpokes([&](uint32_t v, uint32_t u) {
      of_vertices[u] += Turn(vertices_[u].frame, vertices_[v].frame).Back(of_patches[v]);
    });
    std::vector<double> of_hinges(hinges_.size(), 0.0);
    for (size_t h = 0; h < hinges_.size(); ++h) {
      for (size_t k = 0; k < 2; ++k) {
        const uint32_t v = hinges_[h].particles[k];
        const Energy seen = Turn(frames_[h], vertices_[v].frame).Back(of_vertices[v]);
        of_hinges[h] += (seen * energies_[h]).sum() / 2;
      }
    }
    return of_hinges;
  }

  // Half the gradient of the errors of the patches, by their areas, and of the changes of hinges,
  // downwards.
  std::vector<double> Descent(Energies errors, const std::vector<double>& changes) const {
    for (size_t v = 0; v < errors.size(); ++v) errors[v] *= -vertices_[v].area;
    std::vector<double> descent = OfHinges(std::move(errors));
    for (size_t h = 0; h < descent.size(); ++h) descent[h] -= kStay / 3 * areas_[h] * changes[h];
    return descent;
  }

  // Least squares, by conjugate gradients.
  void Fit(Interruption* interruption) {
    Energies errors = OfPatches(factors_);
    std::vector<double> changes = factors_;
    for (double& change : changes) change -= 1;
    for (size_t v = 0; v < errors.size(); ++v) errors[v][0] -= vertices_[v].is_inner ? 1 : 0;
    std::vector<double> rest = Descent(std::move(errors), changes);
    std::vector<double> way(rest.size(), 0.0);
    double size = 0;
    for (int step = 0; step < kFitSteps; ++step) {
      Ask(interruption);
      double new_size = 0;
      for (size_t h = 0; h < rest.size(); ++h) new_size += rest[h] * rest[h] / areas_[h];
      const double keep = step == 0 ? 0 : new_size / size;
      size = new_size;
      for (size_t h = 0; h < rest.size(); ++h) way[h] = rest[h] / areas_[h] + keep * way[h];
      const std::vector<double> pull = Descent(OfPatches(way), way);
      double work = 0;
      for (size_t h = 0; h < rest.size(); ++h) work -= way[h] * pull[h];
      if (!(work > 0)) break;
      for (size_t h = 0; h < rest.size(); ++h) {
        factors_[h] += size / work * way[h];
        rest[h] += size / work * pull[h];
      }
    }
    for (double& factor : factors_) {
      factor = std::isfinite(factor) ? std::clamp(factor, kLeastFactor, kLargestFactor) : 1;
    }
  }

  // Where no stiffness makes hinges a plate they stay as they are, exact along their edges.
  void KeepWhereBad(Interruption* interruption) {
    LetYield(interruption);
    FindEnergies();
    const Energies found = OfPatches(factors_);
    std::vector<double> trust(vertices_.size(), 0.0), around(vertices_.size(), 0.0);
    for (size_t v = 0; v < vertices_.size(); ++v) {
      if (!vertices_[v].is_inner) continue;
      const double error = std::sqrt(found[v].square().sum() - 2 * found[v][0] + 1);
      trust[v] = std::clamp((kBadError - error) / (kBadError - kGoodError), 0.0, 1.0);
      around[v] = 1;
    }
    const std::vector<double> own_trust = trust, own_around = around;
    ForSpokes([&](uint32_t v, uint32_t u) {
      trust[v] += own_trust[u];
      around[v] += own_around[u];
    });
    for (size_t h = 0; h < hinges_.size(); ++h) {
      const auto& [i, j, k, l] = hinges_[h].particles;
      const double count = around[i] + around[j];
      const double share = count > 0 ? (trust[i] + trust[j]) / count : 0;
      factors_[h] = 1 + share * (factors_[h] - 1);
    }
  }

  std::span<const ElasticElement> hinges_;
  std::vector<double> factors_;  // of the stiffness of the hinges
  std::vector<double> areas_;    // of the hinges: rigidity over stiffness [m^2]
  std::vector<Frame> frames_;    // of the hinges
  Responses curves_;             // of the hinges where no vertex gives way [m^2]
  Energies energies_;            // of the hinges, in their frames [m^2]
  std::vector<Vertex> vertices_;
  Responses yields_;  // of the vertices [m^2]
};

}  // namespace

void FitHingesToPlate(std::span<const Vector3d> positions_m, double rigidity_n_m,
                      std::span<ElasticElement> hinges, Interruption* interruption) {
  if (hinges.empty()) return;
  const std::vector<double> factors =
      HingeFit(positions_m, hinges, rigidity_n_m).Solve(interruption);
  for (size_t h = 0; h < hinges.size(); ++h) hinges[h].stiffness_n_per_m *= factors[h];
}

}  // namespace drape
