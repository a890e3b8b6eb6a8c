/* SPDX-License-Identifier: MIT */
#include "web/text.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

int text_begin(struct text *t, const char *op)
{
	t->text = NULL;
	t->out = open_memstream(&t->text, &t->len);
	if (t->out == NULL) {
		return -ENOMEM;
	}
	json_init(&t->json, t->out);
	json_object_begin(&t->json, NULL);
	json_text(&t->json, "op", op);
	return 0;
}

char *text_end(struct text *t)
{
	json_object_end(&t->json);
	if (fclose(t->out) != 0) {
		free(t->text);
		return NULL;
	}
	return t->text;
}

void text_keep(struct text_kept *kept, char *text)
{
	if (text != NULL && (kept->text == NULL || strcmp(text, kept->text) != 0)) {
		free(kept->text);
		kept->text = text;
		kept->number++;
	} else {
		free(text);
	}
}
