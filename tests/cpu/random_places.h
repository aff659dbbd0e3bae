// Places near and far from the origin.
#pragma once

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace drape::cpu {

class RandomPlaces {
 public:
  explicit RandomPlaces(uint32_t seed) : random_(seed), size_m_(std::pow(10, Between(-1, 2.5))) {}
  double Between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  Eigen::Vector3d Vector() {
    return Eigen::Vector3d(Between(-1, 1), Between(-1, 1), Between(-1, 1));
  }
  Eigen::Vector3d Any() { return size_m_ * Vector(); }
  Eigen::Vector3d Direction() { return Any().normalized(); }
  Eigen::Quaterniond Rotation() {
    const double angle = Between(0, 6);
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, Direction()));
  }

 private:
  std::mt19937 random_;
  double size_m_;
};

}  // namespace drape::cpu
