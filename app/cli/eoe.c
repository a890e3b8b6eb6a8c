/* SPDX-License-Identifier: MIT */
/* ecdaq eoe: the IP parameters of a slave (EoE). */
#include <arpa/inet.h>
#include <stdio.h>
#include <string.h>

#include "base/args.h"
#include "cli/hex.h"
#include "cli/mail.h"
#include "cli/source.h"
#include "cli/text.h"
#include "wire/eoe.h"

enum { IP_TEXT_BYTES = 64, MAC_BYTES = 6 };

/* The parameters by their option and key. */
struct field {
	const char *name;
	enum eoe_ip_flag flag;
	size_t offset; /* in struct eoe_ip; of 4 bytes */
	const char *value;
	const char *help;
};

enum { MAC, IP, MASK, GATEWAY, DNS, NAME, FIELDS };

static const struct field fields[FIELDS] = {
	[MAC] = { "mac", EOE_HAS_MAC, 0, "MAC", "set the MAC address, 02:00:00:00:00:01" },
	[IP] = { "ip", EOE_HAS_ADDRESS, offsetof(struct eoe_ip, address), "ADDRESS",
		 "set the IP address" },
	[MASK] = { "mask", EOE_HAS_NETMASK, offsetof(struct eoe_ip, netmask), "MASK",
		   "set the network mask, 255.255.255.0" },
	[GATEWAY] = { "gateway", EOE_HAS_GATEWAY, offsetof(struct eoe_ip, gateway), "ADDRESS",
		      "set the default gateway" },
	[DNS] = { "dns", EOE_HAS_DNS, offsetof(struct eoe_ip, dns), "ADDRESS",
		  "set the DNS server" },
	[NAME] = { "name", EOE_HAS_NAME, 0, "NAME", "set the DNS name, up to 32 characters" },
};

static int parse_mac(const char *text, uint8_t mac[MAC_BYTES])
{
	char spaced[3 * MAC_BYTES];

	if (strlen(text) != sizeof(spaced) - 1) {
		return 0;
	}
	memcpy(spaced, text, sizeof(spaced));
	for (size_t i = 2; i < sizeof(spaced) - 1; i += 3) {
		if (spaced[i] != ':') {
			return 0;
		}
		spaced[i] = ' ';
	}
	return hex_parse(spaced, mac, MAC_BYTES) == MAC_BYTES;
}

static int parse_field(int n, const char *text, struct eoe_ip *ip)
{
	switch (n) {
	case MAC:
		return parse_mac(text, ip->mac);
	case NAME:
		snprintf(ip->name, sizeof(ip->name), "%s", text);
		return strlen(text) <= EOE_NAME_BYTES;
	default: /* an address */
		return inet_pton(AF_INET, text, (uint8_t *)ip + fields[n].offset) == 1;
	}
}

static const char *format_field(int n, const struct eoe_ip *ip, char text[IP_TEXT_BYTES])
{
	const uint8_t *bytes = (const uint8_t *)ip + fields[n].offset;

	switch (n) {
	case MAC:
		snprintf(text, IP_TEXT_BYTES, "%02x:%02x:%02x:%02x:%02x:%02x", ip->mac[0],
			 ip->mac[1], ip->mac[2], ip->mac[3], ip->mac[4], ip->mac[5]);
		break;
	case NAME:
		snprintf(text, IP_TEXT_BYTES, "%s", ip->name);
		break;
	default: /* an address */
		snprintf(text, IP_TEXT_BYTES, "%u.%u.%u.%u", bytes[0], bytes[1], bytes[2],
			 bytes[3]);
		break;
	}
	return text;
}

static void show_json(const struct mail *mail, const struct eoe_ip *ip)
{
	char text[IP_TEXT_BYTES];
	struct json js;

	json_init(&js, stdout);
	json_object_begin(&js, NULL);
	json_u64(&js, "slave", mail->request.slave_pos);
	json_u64(&js, "port", mail->request.argument[0]);
	for (int n = 0; n < FIELDS; n++) {
		if ((ip->flags & fields[n].flag) != 0) {
			json_text(&js, fields[n].name, format_field(n, ip, text));
		} else {
			json_null(&js, fields[n].name);
		}
	}
	json_object_end(&js);
	json_end_line(&js);
}

static enum exit_code show(struct mail *mail)
{
	struct eoe_ip ip = { .flags = 0 };
	char text[IP_TEXT_BYTES];
	char plain[IP_TEXT_BYTES];
	enum exit_code result = mail_ask(mail, ADMIN_EOE_IP_READ);

	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (eoe_ip_get(mail->transfer.answer, mail->transfer.answer_len, &ip) < 0) {
		return cli_fail(mail->cli, EXIT_CODE_FAILED, "ecdaqd: an answer of %zu bytes",
				mail->transfer.answer_len);
	}
	if (mail->is_json) {
		show_json(mail, &ip);
		return EXIT_CODE_OK;
	}
	if (ip.flags == 0) {
		puts("none is set");
	}
	for (int n = 0; n < FIELDS; n++) {
		if ((ip.flags & fields[n].flag) != 0) {
			format_field(n, &ip, text);
			printf("%-8s %s\n", fields[n].name, text_plain(text, plain, sizeof(plain)));
		}
	}
	return EXIT_CODE_OK;
}

/* The words of the options, for the one action. */
struct eoe {
	struct mail mail;
	const char *word[FIELDS]; /* NULL: not given */
};

static enum exit_code run_ip(struct mail *mail, char **operands, int count)
{
	const struct eoe *eoe = (const struct eoe *)mail;
	struct eoe_ip ip = { .flags = 0 };
	enum exit_code result;

	(void)count;
	for (int n = 0; n < FIELDS; n++) {
		if (eoe->word[n] == NULL) {
			continue;
		}
		if (!parse_field(n, eoe->word[n], &ip)) {
			return cli_fail(mail->cli, EXIT_CODE_USAGE, "--%s: %s: is not valid",
					fields[n].name, eoe->word[n]);
		}
		ip.flags |= fields[n].flag;
	}
	result = source_slave_pos(mail->cli, operands[1], &mail->request.slave_pos);
	if (result != EXIT_CODE_OK) {
		return result;
	}
	if (ip.flags == 0) {
		return show(mail);
	}
	eoe_ip_put(mail->request.data, &ip);
	mail->request.data_len = EOE_IP_BYTES;
	return mail_ask(mail, ADMIN_EOE_IP_WRITE);
}

enum exit_code verb_eoe(struct cli *cli, int argc, char **argv)
{
	static const struct mail_action actions[] = {
		{ "ip", 2, 2, "ip: expected SLAVE", run_ip },
	};
	struct eoe eoe = { .word = { NULL } };
	struct args_integer port = { .low = 0, .high = 15 };
	struct args_option options[FIELDS + 2] = {
		[FIELDS] = { "port", 0, args_integer, &port, "N",
			     "port of a slave that is a switch, 1 to 15 (0: it is none)" },
		[FIELDS + 1] = { "json", 0, args_flag, &eoe.mail.is_json, NULL,
				 "the parameters as a JSON object" },
	};
	struct args args = {
		.options = options, .option_count = FIELDS + 2, .operands_min = 2, .operands_max = 2
	};
	enum exit_code result;

	for (int n = 0; n < FIELDS; n++) {
		options[n] = (struct args_option){ fields[n].name,  0,
						   args_text,       &eoe.word[n],
						   fields[n].value, fields[n].help };
	}
	mail_init(&eoe.mail, cli);
	if (!cli_parse(cli, &args, argc, argv, &result)) {
		return result;
	}
	eoe.mail.request.argument[0] = (uint32_t)port.value;
	return mail_run(&eoe.mail, actions, 1, args.operands, args.operand_count);
}
