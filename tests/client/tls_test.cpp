// TLS: trusted certificates, and the messages for untrusted ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drape/client.h"
#include "tests/client/client_test_support.h"
#include "tests/support/certificates/certificates.h"

namespace drape {
namespace {

using client_test::ErrorOf;
using client_test::Outcome;
using client_test::ProgramPath;
using client_test::RunProgram;
using testing::HasSubstr;
namespace fs = std::filesystem;

// A server whose certificate, its own authority, is for the name drape.test alone.
class TlsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new Shared;
    const test::Certificate own = shared_->folder.MakeAuthority("own");
    shared_->cert = own.certificate;
    shared_->other_cert = shared_->folder.MakeAuthority("other").certificate;
    SpawnOptions spawn;
    spawn.backend = "cpu";
    spawn.executable = ProgramPath("draped");
    spawn.flags = {"--tls-cert=" + shared_->cert.string(), "--tls-key=" + own.key};
    shared_->client.emplace(Client::SpawnServer(spawn, Trusting(shared_->cert, "drape.test")));
  }
  static void TearDownTestSuite() {
    delete shared_;
    shared_ = nullptr;
  }

  static ConnectOptions Trusting(const fs::path& authorities, const std::string& name) {
    return {.ready_timeout_s = 10,
            .request_timeout_s = 0,
            .tls = TlsOptions{.authorities_file = authorities, .server_name = name}};
  }
  // The message that replaces a connection.
  static std::string Refusal(std::optional<TlsOptions> tls) {
    ConnectOptions options;
    options.ready_timeout_s = 0.5;
    options.tls = std::move(tls);
    const ErrorDetails details =
        ErrorOf([&] { Client::Connect(shared_->client->address(), options); });
    EXPECT_EQ(details.code, ErrorCode::kUnavailable);
    EXPECT_EQ(details.reason, "CANNOT_CONNECT");
    return details.message;
  }
  static Outcome Health(std::vector<std::string> flags) {
    flags.insert(flags.begin(), {"health", "--server=" + shared_->client->address()});
    return RunProgram("drape", flags);
  }
  static const fs::path& Cert() { return shared_->cert; }
  static const fs::path& OtherCert() { return shared_->other_cert; }
  static const Client& Connected() { return *shared_->client; }

 private:
  struct Shared {
    test::CertificateFolder folder;
    fs::path cert;
    fs::path other_cert;
    std::optional<Client> client;
  };

  static inline Shared* shared_ = nullptr;
};

TEST_F(TlsTest, ATrustedServerIsUsedLikeAnyOther) {
  const Client client = Client::Connect(Connected().address(), Trusting(Cert(), "drape.test"));
  EXPECT_EQ(client.GetServerInfo().backend(), "cpu");
  EXPECT_EQ(client.CheckHealth(), Health::kServing);
  Session session = client.CreateSession();
  v1::ClothSpec spec;
  spec.mutable_grid()->set_columns(8);
  spec.mutable_grid()->set_rows(8);
  spec.mutable_grid()->set_width_m(1);
  spec.mutable_grid()->set_height_m(1);
  session.CreateCloth(spec);
  session.Step(3);
  EXPECT_EQ(session.ReadStates()[0].step, 3u);
}

TEST_F(TlsTest, AServerOfAnotherAuthorityIsNot) {
  const std::string text = Refusal(TlsOptions{OtherCert(), "drape.test"});
  EXPECT_THAT(text, HasSubstr("over TLS"));
  EXPECT_THAT(text, HasSubstr("certificate verify failed"));
}

TEST_F(TlsTest, AServerOfAnotherNameIsNot) {
  EXPECT_THAT(Refusal(TlsOptions{Cert(), ""}), HasSubstr("Peer name 127.0.0.1 is not in"));
}

TEST_F(TlsTest, NothingIsSentInTheClear) {
  EXPECT_THAT(Refusal(std::nullopt), HasSubstr("without TLS"));
}

TEST_F(TlsTest, AFileWithoutCertificatesIsNamed) {
  const ErrorDetails details = ErrorOf([&] {
    Client::Connect(Connected().address(), Trusting(Cert().parent_path() / "none.pem", ""));
  });
  EXPECT_EQ(details.code, ErrorCode::kFailedPrecondition);
  EXPECT_EQ(details.reason, "TLS_FILE_FAILED");
  EXPECT_THAT(details.message, HasSubstr("none.pem"));
}

TEST_F(TlsTest, TheCommandLineTrustsAFile) {
  const Outcome outcome = Health({"--tls-ca=" + Cert().string(), "--tls-server-name=drape.test"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "SERVING\n");
}

TEST_F(TlsTest, TheCommandLineTrustsWhomTheSystemTrusts) {
  setenv("GRPC_DEFAULT_SSL_ROOTS_FILE_PATH", Cert().c_str(), /*overwrite=*/1);
  const Outcome outcome = Health({"--tls", "--tls-server-name=drape.test"});
  unsetenv("GRPC_DEFAULT_SSL_ROOTS_FILE_PATH");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
}

TEST_F(TlsTest, TheCommandLineSaysWhyNotInOneLine) {
  const Outcome outcome = Health({"--tls-ca=" + OtherCert().string()});
  EXPECT_EQ(outcome.exit_code, 1);
  EXPECT_THAT(outcome.err, HasSubstr("certificate verify failed"));
  EXPECT_EQ(outcome.err.find('\n'), outcome.err.size() - 1) << outcome.err;
}

TEST_F(TlsTest, FlagsOfTlsNeedAServer) {
  for (const char* flag : {"--tls", "--tls-server-name=x"}) {
    const Outcome outcome = RunProgram("drape", {"info", flag});
    EXPECT_EQ(outcome.exit_code, 2) << flag;
    EXPECT_THAT(outcome.err, HasSubstr("--server")) << flag;
  }
}

// A server of its own for each test; its certificate is for drape.test.
class CertificatesTest : public testing::Test {
 protected:
  void Start(std::vector<std::string> flags) {
    flags.insert(flags.end(), {"--tls-cert=" + server_.certificate, "--tls-key=" + server_.key});
    SpawnOptions spawn;
    spawn.backend = "cpu";
    spawn.executable = ProgramPath("draped");
    spawn.flags = std::move(flags);
    first_.emplace(Client::SpawnServer(spawn, By(alice_)));
  }
  static ConnectOptions Trusting(const test::Certificate& authority,
                                 const test::Certificate& own = {}) {
    return {.ready_timeout_s = 2,
            .tls = TlsOptions{.authorities_file = authority.certificate,
                              .server_name = "drape.test",
                              .certificate_file = own.certificate,
                              .key_file = own.key}};
  }
  ConnectOptions By(const test::Certificate& client) const { return Trusting(server_, client); }
  Client Connect(const ConnectOptions& options) const {
    return Client::Connect(first_->address(), options);
  }
  // Of connecting and asking: with TLS 1.3 a client learns by its first call that it is refused.
  ErrorDetails RefusalOf(const ConnectOptions& options) const {
    return ErrorOf([&] { Connect(options).CreateSession(); });
  }
  bool IsTrusted(const test::Certificate& authority) const {
    try {
      return Connect(Trusting(authority)).GetServerInfo().backend() == "cpu";
    } catch (const Error&) {
      return false;
    }
  }

  const test::CertificateFolder folder_;
  const test::Certificate server_ = folder_.MakeAuthority("server");
  const test::Certificate clients_ = folder_.MakeAuthority("clients");
  const test::Certificate alice_ = folder_.Issue("alice", "alice", clients_);
  std::optional<Client> first_;  // the server ends with it
};

TEST_F(CertificatesTest, TheTenantIsTheCommonName) {
  Start({"--tls-client-ca=" + clients_.certificate});
  const test::Certificate bob = folder_.Issue("bob", "bob", clients_);
  const Client alice = Connect(By(alice_)), also_alice = Connect(By(alice_)),
               bobs = Connect(By(bob));
  const Session session = alice.CreateSession();
  EXPECT_EQ(alice.ListSessions().size(), 1u);
  EXPECT_EQ(also_alice.ListSessions().size(), 1u);
  EXPECT_EQ(bobs.ListSessions().size(), 0u);
}

TEST_F(CertificatesTest, StrangersAreRefused) {
  Start({"--tls-client-ca=" + clients_.certificate});
  const test::Certificate others = folder_.MakeAuthority("others");
  EXPECT_EQ(RefusalOf(By({})).code, ErrorCode::kUnavailable);
  EXPECT_EQ(RefusalOf(By(folder_.Issue("eve", "alice", others))).code, ErrorCode::kUnavailable);
  const ErrorDetails no_name = RefusalOf(By(folder_.Issue("odd", "no tenant!", clients_)));
  EXPECT_EQ(no_name.code, ErrorCode::kUnauthenticated);
  EXPECT_EQ(no_name.reason, "INVALID_TOKEN");
}

TEST_F(CertificatesTest, RenewedOnesAreUsedWithoutARestart) {
  Start({});
  const Client connected = Connect(Trusting(server_));
  const test::Certificate old{folder_.Path("old.pem"), folder_.Path("old.key")};
  fs::copy(server_.certificate, old.certificate);
  const test::Certificate renewed = folder_.MakeAuthority("renewed");
  fs::copy(renewed.key, server_.key, fs::copy_options::overwrite_existing);
  std::this_thread::sleep_for(std::chrono::seconds(5));  // looks at the files come every other one
  EXPECT_TRUE(IsTrusted(old)) << "half renewed, nobody can connect";
  fs::copy(renewed.certificate, server_.certificate, fs::copy_options::overwrite_existing);
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!IsTrusted(renewed) && std::chrono::steady_clock::now() < until) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  EXPECT_TRUE(IsTrusted(renewed)) << "the new certificate is not used";
  EXPECT_FALSE(IsTrusted(old)) << "the old one is";
  EXPECT_EQ(connected.GetServerInfo().backend(), "cpu") << "connections stay";
}

TEST_F(CertificatesTest, TheCommandLineShowsACertificate) {
  Start({"--tls-client-ca=" + clients_.certificate});
  const Outcome outcome =
      RunProgram("drape", {"health", "--server=" + first_->address(),
                           "--tls-ca=" + server_.certificate, "--tls-server-name=drape.test",
                           "--tls-cert=" + alice_.certificate, "--tls-key=" + alice_.key});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(outcome.out, "SERVING\n");
}

}  // namespace
}  // namespace drape
