// The fake's side of the network: Wi-Fi, sockets and HMACs, after ESP-IDF 5.5's documentation (API
// Reference, by chapter).
#include "idf.hpp"

using fake::call;
using fake::chip;

const char* const IP_EVENT = "ip";
const char* const WIFI_EVENT = "wifi";

// ESP-NETIF, Event Loop Library and Wi-Fi: a station connects when it has started and again when it
// was disconnected; its address comes as an event. lwIP: MSG_DONTWAIT answers -1 where there is
// nothing. Mbed TLS: every step of an HMAC answers 0 or an error.
static std::map<std::string, esp_event_handler_t> handlers;
esp_err_t esp_netif_init() { return call("esp_netif_init"); }
esp_err_t esp_event_loop_create_default() { return call("esp_event_loop_create_default"); }
esp_netif_t* esp_netif_create_default_wifi_sta() {
  return call("esp_netif_create_default_wifi_sta") == ESP_OK ? reinterpret_cast<esp_netif_t*>(&chip)
                                                             : nullptr;
}
esp_err_t esp_event_handler_instance_register(esp_event_base_t base, int32_t,
                                              esp_event_handler_t handler, void*, void*) {
  handlers[base] = handler;
  return call("esp_event_handler_instance_register");
}
esp_err_t esp_wifi_init(const wifi_init_config_t*) { return call("esp_wifi_init"); }
esp_err_t esp_wifi_set_storage(int) { return call("esp_wifi_set_storage"); }
esp_err_t esp_wifi_set_mode(int) { return call("esp_wifi_set_mode"); }
esp_err_t esp_wifi_set_config(int, const wifi_config_t*) { return call("esp_wifi_set_config"); }
esp_err_t esp_wifi_start() {
  const esp_err_t status = call("esp_wifi_start");
  if (status != ESP_OK) return status;
  ip_event_got_ip_t given{};
  given.ip_info.ip.addr = 0x0100007F;
  for (const int32_t other : {7, 99}) {
    handlers["wifi"](nullptr, WIFI_EVENT, other, nullptr);
    handlers["ip"](nullptr, IP_EVENT, other, nullptr);
  }
  handlers["wifi"](nullptr, WIFI_EVENT, WIFI_EVENT_STA_START, nullptr);
  handlers["wifi"](nullptr, WIFI_EVENT, WIFI_EVENT_STA_DISCONNECTED, nullptr);
  handlers["ip"](nullptr, IP_EVENT, IP_EVENT_STA_GOT_IP, &given);
  return status;
}
esp_err_t esp_wifi_set_ps(int) { return call("esp_wifi_set_ps"); }
esp_err_t esp_wifi_connect() { return call("esp_wifi_connect"); }

int fake_socket(int, int, int) { return call("socket") == ESP_OK ? 3 : -1; }
int fake_bind(int, const sockaddr*, socklen_t) { return call("bind"); }
int fake_recvfrom(int, void* bytes, size_t count, int, sockaddr*, socklen_t*) {
  if (chip.datagrams_in.empty()) return -1;
  const std::vector<uint8_t> first = chip.datagrams_in.front();
  chip.datagrams_in.erase(chip.datagrams_in.begin());
  const size_t taken = first.size() < count ? first.size() : count;
  std::memcpy(bytes, first.data(), taken);
  return static_cast<int>(taken);
}
int fake_sendto(int, const void* bytes, size_t count, int, const sockaddr*, socklen_t) {
  const auto* first = static_cast<const uint8_t*>(bytes);
  chip.datagrams_out.emplace_back(first, first + count);
  return static_cast<int>(count);
}

void mbedtls_md_init(mbedtls_md_context_t*) {}
const mbedtls_md_info_t* mbedtls_md_info_from_type(int) {
  static mbedtls_md_info_t sha256;
  return call("mbedtls_md_info_from_type") == ESP_OK ? &sha256 : nullptr;
}
int mbedtls_md_setup(mbedtls_md_context_t*, const mbedtls_md_info_t*, int) {
  return call("mbedtls_md_setup");
}
int mbedtls_md_hmac_starts(mbedtls_md_context_t*, const uint8_t*, size_t) {
  return call("mbedtls_md_hmac_starts");
}
int mbedtls_md_hmac_update(mbedtls_md_context_t*, const uint8_t*, size_t) {
  return call("mbedtls_md_hmac_update");
}
int mbedtls_md_hmac_finish(mbedtls_md_context_t*, uint8_t* mac) {
  std::memset(mac, 0, 32);
  return call("mbedtls_md_hmac_finish");
}
