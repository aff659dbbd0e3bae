// Between clients and a server: passes bytes on, and cuts connections.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <list>
#include <random>
#include <string>
#include <thread>

namespace drape::test {

// Passes bytes on between its clients and a port of this machine, and cuts each connection after
// some random number of them, which is of every size between `least_bytes` and `most_bytes`. What
// was sent until then arrives, unchanged. Thread-safe.
class CuttingProxy {
 public:
  explicit CuttingProxy(int target_port, size_t least_bytes = 300, size_t most_bytes = 8000);
  ~CuttingProxy();
  CuttingProxy(const CuttingProxy&) = delete;
  CuttingProxy& operator=(const CuttingProxy&) = delete;

  // For new connections; those that exist are cut. 0: new ones wait until there is a target.
  void SetTarget(int port) { target_port_ = port; }
  // Connections that exist are cut after so many bytes more; later ones are not cut.
  void CutOnceAfter(size_t bytes) { cut_once_after_ = bytes; }
  // From now on nothing is passed on, and nobody is told: as if a cable was unplugged.
  void Unplug() { is_unplugged_ = true; }
  // Bytes of the connection that was cut last, since CutOnceAfter.
  size_t sent_before_cut() const { return sent_before_cut_; }
  size_t received_before_cut() const { return received_before_cut_; }
  std::string Address() const { return "127.0.0.1:" + std::to_string(port_); }
  int cuts() const { return cuts_; }

 private:
  struct Connection {
    int client = -1;
    int server = -1;  // -1: it waits for a target
    int target_port = 0;
    size_t bytes_left = 0;
    size_t sent = 0;
    size_t received = 0;
  };
  static constexpr size_t kNever = SIZE_MAX;

  void Loop();
  void Accept();
  // False: it has ended, or is to be cut.
  bool Pass(Connection& connection, short client_events, short server_events) const;
  static bool Move(int from, int into, size_t& bytes_left, size_t& moved);
  static int ConnectTo(int port);

  const size_t least_bytes_;
  const size_t most_bytes_;
  std::mt19937 random_{7};
  std::atomic<int> target_port_;
  int listener_ = -1;
  int port_ = 0;
  std::list<Connection> connections_;  // of the thread
  std::atomic<bool> is_over_ = false;
  std::atomic<bool> is_unplugged_ = false;
  std::atomic<int> cuts_ = 0;
  std::atomic<size_t> cut_once_after_ = kNever;
  bool cuts_new_ones_ = true;  // of the thread
  std::atomic<size_t> sent_before_cut_ = 0;
  std::atomic<size_t> received_before_cut_ = 0;
  std::thread thread_;
};

// The port of "127.0.0.1:<port>".
int PortOf(const std::string& address);

}  // namespace drape::test
