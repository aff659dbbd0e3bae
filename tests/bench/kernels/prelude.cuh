// What a translated kernel needs of GLSL, for NVRTC (translate.py).
using uint = unsigned int;
#define GLSL __device__ __forceinline__

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
  GLSL T& operator[](int k) { return k == 0 ? x : k == 1 ? y : z; }
  GLSL T operator[](int k) const { return k == 0 ? x : k == 1 ? y : z; }
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
  GLSL T operator[](int k) const { return k == 0 ? x : k == 1 ? y : k == 2 ? z : w; }
};

using vec2 = Vec2<float>;
using vec3 = Vec3<float>;
using vec4 = Vec4<float>;
using uvec2 = Vec2<uint>;
using uvec3 = Vec3<uint>;
using uvec4 = Vec4<uint>;
using ivec2 = Vec2<int>;

#define VECTOR_OPERATOR(op)                                                                  \
  template <typename T> GLSL Vec2<T> operator op(Vec2<T> a, Vec2<T> b) {                     \
    return {a.x op b.x, a.y op b.y};                                                         \
  }                                                                                          \
  template <typename T> GLSL Vec3<T> operator op(Vec3<T> a, Vec3<T> b) {                     \
    return {a.x op b.x, a.y op b.y, a.z op b.z};                                             \
  }                                                                                          \
  template <typename T> GLSL Vec4<T> operator op(Vec4<T> a, Vec4<T> b) {                     \
    return {a.x op b.x, a.y op b.y, a.z op b.z, a.w op b.w};                                 \
  }                                                                                          \
  GLSL vec2 operator op(vec2 a, float b) { return a op vec2(b); }                            \
  GLSL vec3 operator op(vec3 a, float b) { return a op vec3(b); }                            \
  GLSL vec3 operator op(float a, vec3 b) { return vec3(a) op b; }                            \
  GLSL uvec3 operator op(uvec3 a, uint b) { return a op uvec3(b); }
VECTOR_OPERATOR(+)
VECTOR_OPERATOR(-)
VECTOR_OPERATOR(*)
VECTOR_OPERATOR(/)
GLSL vec3 operator-(vec3 v) { return {-v.x, -v.y, -v.z}; }
GLSL vec2& operator+=(vec2& a, vec2 b) { return a = a + b; }
GLSL vec3& operator+=(vec3& a, vec3 b) { return a = a + b; }
GLSL vec3& operator-=(vec3& a, vec3 b) { return a = a - b; }
GLSL bool operator==(vec3 a, vec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
GLSL bool operator!=(vec3 a, vec3 b) { return !(a == b); }

struct mat3 {
  vec3 columns[3];
  mat3() = default;
  GLSL mat3(vec3 a, vec3 b, vec3 c) {
    columns[0] = a;
    columns[1] = b;
    columns[2] = c;
  }
  GLSL vec3& operator[](int k) { return columns[k]; }
  GLSL vec3 operator[](int k) const { return columns[k]; }
};
GLSL vec3 operator*(const mat3& m, vec3 v) {
  return m[0] * v.x + m[1] * v.y + m[2] * v.z;
}
GLSL vec3 operator*(vec3 v, const mat3& m) {
  const auto dot = [](vec3 a, vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; };
  return {dot(v, m[0]), dot(v, m[1]), dot(v, m[2])};
}

GLSL float uintBitsToFloat(uint bits) { return __uint_as_float(bits); }
GLSL vec3 uintBitsToFloat(uvec3 v) {
  return {__uint_as_float(v.x), __uint_as_float(v.y), __uint_as_float(v.z)};
}
GLSL uint floatBitsToUint(float x) { return __float_as_uint(x); }
GLSL float fma(float a, float b, float c) { return fmaf(a, b, c); }
GLSL int findLSB(uint x) { return __ffs(x) - 1; }

template <typename T> GLSL T LeastOf(T a, T b) { return b < a ? b : a; }
template <typename T> GLSL T MostOf(T a, T b) { return a < b ? b : a; }
GLSL float LeastOf(float a, float b) { return fminf(a, b); }
GLSL float MostOf(float a, float b) { return fmaxf(a, b); }
GLSL float min(float a, float b) { return LeastOf(a, b); }
GLSL float max(float a, float b) { return MostOf(a, b); }
template <typename T> GLSL Vec3<T> min(Vec3<T> a, Vec3<T> b) {
  return {LeastOf(a.x, b.x), LeastOf(a.y, b.y), LeastOf(a.z, b.z)};
}
template <typename T> GLSL Vec3<T> max(Vec3<T> a, Vec3<T> b) {
  return {MostOf(a.x, b.x), MostOf(a.y, b.y), MostOf(a.z, b.z)};
}
GLSL vec3 abs(vec3 v) { return {fabsf(v.x), fabsf(v.y), fabsf(v.z)}; }
template <typename T> GLSL T clamp(T x, T low, T high) { return min(max(x, low), high); }
GLSL float clamp(float x, float low, float high) { return min(max(x, low), high); }
GLSL float inversesqrt(float x) { return rsqrtf(x); }
GLSL float mix(float a, float b, float t) { return a * (1.0f - t) + b * t; }
GLSL vec3 mix(vec3 a, vec3 b, bvec3 is_b) {
  return {is_b.x ? b.x : a.x, is_b.y ? b.y : a.y, is_b.z ? b.z : a.z};
}
GLSL bvec3 lessThan(vec3 a, vec3 b) { return {a.x < b.x, a.y < b.y, a.z < b.z}; }
GLSL bvec3 lessThanEqual(vec3 a, vec3 b) { return {a.x <= b.x, a.y <= b.y, a.z <= b.z}; }
GLSL bvec3 greaterThanEqual(vec3 a, vec3 b) { return lessThanEqual(b, a); }
GLSL bvec3 equal(vec3 a, vec3 b) { return {a.x == b.x, a.y == b.y, a.z == b.z}; }
GLSL bool all(bvec3 v) { return v.x && v.y && v.z; }

// Loads and stores of shared and storage words; std430 blocks are as C++ lays them out.
GLSL uint atomicOr(uint& word, uint value) { return ::atomicOr(&word, value); }
GLSL uint atomicAnd(uint& word, uint value) { return ::atomicAnd(&word, value); }
GLSL uint atomicAdd(uint& word, uint value) { return ::atomicAdd(&word, value); }
GLSL uint atomicMax(uint& word, uint value) { return ::atomicMax(&word, value); }
GLSL void barrier() { __syncthreads(); }
GLSL void memoryBarrierShared() {}  // __syncthreads orders shared memory
GLSL void memoryBarrierBuffer() { __threadfence(); }
GLSL void subgroupBarrier() { __syncwarp(); }
GLSL void subgroupMemoryBarrierShared() {}  // __syncwarp orders shared memory
GLSL float subgroupShuffle(float x, uint lane) { return __shfl_sync(~0u, x, int(lane)); }
GLSL uint subgroupShuffle(uint x, uint lane) { return __shfl_sync(~0u, x, int(lane)); }
GLSL vec4 subgroupShuffle(vec4 v, uint lane) {
  return {subgroupShuffle(v.x, lane), subgroupShuffle(v.y, lane), subgroupShuffle(v.z, lane),
          subgroupShuffle(v.w, lane)};
}
GLSL uvec4 subgroupBallot(bool flag) { return {__ballot_sync(~0u, flag), 0u, 0u, 0u}; }

#define gl_LocalInvocationID threadIdx
#define gl_WorkGroupID blockIdx
#define gl_NumWorkGroups gridDim
#define gl_GlobalInvocationID uvec3(blockIdx.x * blockDim.x + threadIdx.x, blockIdx.y, blockIdx.z)
#define gl_SubgroupSize 32u
#define gl_NumSubgroups (uint(LOCAL_SIZE) / 32u)
#define gl_SubgroupID (threadIdx.x / 32u)
#define gl_SubgroupInvocationID (threadIdx.x % 32u)
