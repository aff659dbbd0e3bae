// TLS: trusted certificates, and the messages for untrusted ones.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "drape/client.h"
#include "tests/client/client_test_support.h"

namespace drape {
namespace {

using client_test::ErrorOf;
using client_test::Outcome;
using client_test::ProgramPath;
using client_test::RunProgram;
using client_test::TemporaryFolder;
using testing::HasSubstr;
namespace fs = std::filesystem;

// A server whose certificate, its own authority, is for the name drape.test alone.
class TlsTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    shared_ = new Shared;
    shared_->cert = MakeCertificate("own");
    shared_->other_cert = MakeCertificate("other");
    SpawnOptions spawn;
    spawn.backend = "cpu";
    spawn.executable = ProgramPath("draped");
    spawn.flags = {"--tls-cert=" + shared_->cert.string(),
                   "--tls-key=" + (shared_->folder / "own.key").string()};
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
    TemporaryFolder folder;
    fs::path cert;
    fs::path other_cert;
    std::optional<Client> client;
  };

  static fs::path MakeCertificate(const std::string& name) {
    fs::path cert = shared_->folder / (name + ".pem");
    const std::string command =
        "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 "
        "-subj /CN=drape -addext subjectAltName=DNS:drape.test -keyout " +
        (shared_->folder / (name + ".key")).string() + " -out " + cert.string() + " 2>/dev/null";
    EXPECT_EQ(std::system(command.c_str()), 0)
        << "openssl is needed (./run test installs it): " << command;
    return cert;
  }

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

}  // namespace
}  // namespace drape
