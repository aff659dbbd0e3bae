// Vectors of GLSL, and as they are in memory (glsl.h).
#pragma once

struct bvec3 {
  bool x, y, z;
};

template <typename T>
struct Vec2 {
  T x, y;
  Vec2() = default;
  GLSL Vec2(T all) : x(all), y(all) {}
  GLSL Vec2(T a, T b) : x(a), y(b) {}
  GLSL Vec2 xy() const { return *this; }
};

template <typename T>
struct Vec3 {
  T x, y, z;
  Vec3() = default;
  GLSL Vec3(T all) : x(all), y(all), z(all) {}
  GLSL Vec3(T a, T b, T c) : x(a), y(b), z(c) {}
  template <typename U>
  GLSL explicit Vec3(const Vec3<U>& v) : x(T(v.x)), y(T(v.y)), z(T(v.z)) {}
  GLSL T& operator[](uint k) { return (&x)[Array<T, 3>::Checked(k)]; }
  GLSL T operator[](uint k) const { return (&x)[Array<T, 3>::Checked(k)]; }
  GLSL Vec2<T> xy() const { return {x, y}; }
  GLSL Vec3 xyz() const { return *this; }
};

template <typename T>
struct alignas(16) Vec4 {
  T x, y, z, w;
  Vec4() = default;
  GLSL Vec4(T all) : x(all), y(all), z(all), w(all) {}
  GLSL Vec4(T a, T b, T c, T d) : x(a), y(b), z(c), w(d) {}
  GLSL Vec4(Vec3<T> v, T d) : x(v.x), y(v.y), z(v.z), w(d) {}
  GLSL Vec4(T a, Vec3<T> v) : x(a), y(v.x), z(v.y), w(v.z) {}
  GLSL Vec4(Vec2<T> v, T c, T d) : x(v.x), y(v.y), z(c), w(d) {}
  GLSL Vec4(Vec2<T> a, Vec2<T> b) : x(a.x), y(a.y), z(b.x), w(b.y) {}
  GLSL Vec3<T> xyz() const { return {x, y, z}; }
  GLSL Vec2<T> xy() const { return {x, y}; }
  GLSL Vec2<T> zw() const { return {z, w}; }
  GLSL Vec2<T> xz() const { return {x, z}; }
  GLSL Vec2<T> yw() const { return {y, w}; }
  GLSL T& operator[](uint k) { return (&x)[Array<T, 4>::Checked(k)]; }
  GLSL T operator[](uint k) const { return (&x)[Array<T, 4>::Checked(k)]; }
};

using vec2 = Vec2<Float>;
using vec3 = Vec3<Float>;
using vec4 = Vec4<Float>;
using uvec2 = Vec2<uint>;
using uvec3 = Vec3<uint>;
using uvec4 = Vec4<uint>;
using ivec2 = Vec2<int>;

// Vectors whose components are words of memory.
struct WordVec2 {
  Word<Float> x, y;
  GLSL WordVec2& operator=(vec2 v) {
    x = v.x;
    y = v.y;
    return *this;
  }
  GLSL operator vec2() const { return {x, y}; }
};
struct WordVec3 {
  Word<Float> x, y, z;
  GLSL WordVec3& operator=(vec3 v) {
    x = v.x;
    y = v.y;
    z = v.z;
    return *this;
  }
  GLSL operator vec3() const { return {x, y, z}; }
};
struct alignas(16) WordVec4 {
  Word<Float> x, y, z, w;
  GLSL WordVec4& operator=(vec4 v) {
    x = v.x;
    y = v.y;
    z = v.z;
    w = v.w;
    return *this;
  }
  GLSL operator vec4() const { return {x, y, z, w}; }
  GLSL vec3 xyz() const { return {x, y, z}; }
};

#define VECTOR_OPERATOR(op)                                  \
  template <typename T>                                      \
  GLSL Vec2<T> operator op(Vec2<T> a, Vec2<T> b) {           \
    return {a.x op b.x, a.y op b.y};                         \
  }                                                          \
  template <typename T>                                      \
  GLSL Vec3<T> operator op(Vec3<T> a, Vec3<T> b) {           \
    return {a.x op b.x, a.y op b.y, a.z op b.z};             \
  }                                                          \
  template <typename T>                                      \
  GLSL Vec4<T> operator op(Vec4<T> a, Vec4<T> b) {           \
    return {a.x op b.x, a.y op b.y, a.z op b.z, a.w op b.w}; \
  }                                                          \
  GLSL vec2 operator op(vec2 a, Float b) {                   \
    return a op vec2(b);                                     \
  }                                                          \
  GLSL vec2 operator op(Float a, vec2 b) {                   \
    return vec2(a) op b;                                     \
  }                                                          \
  GLSL vec3 operator op(vec3 a, Float b) {                   \
    return a op vec3(b);                                     \
  }                                                          \
  GLSL vec3 operator op(Float a, vec3 b) {                   \
    return vec3(a) op b;                                     \
  }                                                          \
  GLSL vec4 operator op(vec4 a, Float b) {                   \
    return a op vec4(b);                                     \
  }                                                          \
  GLSL vec4 operator op(Float a, vec4 b) {                   \
    return vec4(a) op b;                                     \
  }                                                          \
  GLSL uvec3 operator op(uvec3 a, uint b) {                  \
    return a op uvec3(b);                                    \
  }
VECTOR_OPERATOR(+)
VECTOR_OPERATOR(-)
VECTOR_OPERATOR(*)
VECTOR_OPERATOR(/)
GLSL vec2 operator-(vec2 v) {
  return {-v.x, -v.y};
}
GLSL vec3 operator-(vec3 v) {
  return {-v.x, -v.y, -v.z};
}
GLSL vec2& operator+=(vec2& a, vec2 b) {
  return a = a + b;
}
GLSL vec3& operator+=(vec3& a, vec3 b) {
  return a = a + b;
}
GLSL vec3& operator-=(vec3& a, vec3 b) {
  return a = a - b;
}
GLSL vec3& operator*=(vec3& a, Float b) {
  return a = a * b;
}
GLSL bool operator==(vec3 a, vec3 b) {
  return a.x == b.x && a.y == b.y && a.z == b.z;
}
GLSL bool operator!=(vec3 a, vec3 b) {
  return !(a == b);
}

struct mat3 {
  Array<vec3, 3> columns;
  mat3() = default;
  GLSL mat3(vec3 a, vec3 b, vec3 c) : columns{{a, b, c}} {}
  GLSL vec3& operator[](uint k) { return columns[k]; }
  GLSL vec3 operator[](uint k) const { return columns[k]; }
};
GLSL Float dot(vec3 a, vec3 b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
GLSL vec3 operator*(const mat3& m, vec3 v) {
  return m[0] * v.x + m[1] * v.y + m[2] * v.z;
}
GLSL vec3 operator*(vec3 v, const mat3& m) {
  return {dot(v, m[0]), dot(v, m[1]), dot(v, m[2])};
}

GLSL vec3 uintBitsToFloat(uvec3 v) {
  return {uintBitsToFloat(v.x), uintBitsToFloat(v.y), uintBitsToFloat(v.z)};
}
template <typename T>
GLSL Vec3<T> min(Vec3<T> a, Vec3<T> b) {
  return {min(a.x, b.x), min(a.y, b.y), min(a.z, b.z)};
}
template <typename T>
GLSL Vec3<T> max(Vec3<T> a, Vec3<T> b) {
  return {max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)};
}
GLSL vec3 max(vec3 a, Float b) {
  return max(a, vec3(b));
}
GLSL vec3 min(vec3 a, Float b) {
  return min(a, vec3(b));
}
GLSL vec3 abs(vec3 v) {
  return {abs(v.x), abs(v.y), abs(v.z)};
}
GLSL vec3 floor(vec3 v) {
  return {floor(v.x), floor(v.y), floor(v.z)};
}
template <typename T>
GLSL Vec3<T> clamp(Vec3<T> x, Vec3<T> low, Vec3<T> high) {
  return min(max(x, low), high);
}
GLSL vec3 clamp(vec3 x, Float low, Float high) {
  return clamp(x, vec3(low), vec3(high));
}
GLSL vec3 mix(vec3 a, vec3 b, bvec3 is_b) {
  return {is_b.x ? b.x : a.x, is_b.y ? b.y : a.y, is_b.z ? b.z : a.z};
}
GLSL vec3 mix(vec3 a, vec3 b, Float t) {
  return a * (Float(1.0f) - t) + b * t;
}
GLSL bvec3 lessThan(vec3 a, vec3 b) {
  return {a.x < b.x, a.y < b.y, a.z < b.z};
}
GLSL bvec3 lessThanEqual(vec3 a, vec3 b) {
  return {a.x <= b.x, a.y <= b.y, a.z <= b.z};
}
GLSL bvec3 greaterThan(vec3 a, vec3 b) {
  return lessThan(b, a);
}
GLSL bvec3 greaterThanEqual(vec3 a, vec3 b) {
  return lessThanEqual(b, a);
}
GLSL bvec3 equal(vec3 a, vec3 b) {
  return {a.x == b.x, a.y == b.y, a.z == b.z};
}
GLSL bool all(bvec3 v) {
  return v.x && v.y && v.z;
}
GLSL bool any(bvec3 v) {
  return v.x || v.y || v.z;
}
