/* io/xml.h -- reading XML from a file that nobody vouches for. */
#ifndef KELLER_IO_XML_H
#define KELLER_IO_XML_H
#include "keller/error.h"
#include <libxml/parser.h>
#include <libxml/tree.h>

/* Larger files are refused. */
#define KELLER_XML_MAX_BYTES (64u << 20)

/* Parses `file` into *doc (on success owned by the caller: xmlFreeDoc). Comments are kept, CDATA sections become
 * text.
 *
 * Nothing but the file itself is ever opened: a document type declaration is refused before it is read, so there are
 * no entities other than &lt; &gt; &amp; &quot; &apos; and character references, and libxml2's own limits on depth
 * (256) and size stay on. libxml2 never prints; its first error becomes the message. The root element exists on
 * success.
 * Errors: KELLER_IO (cannot open or read; not a regular file), KELLER_BAD_INPUT (FILE:LINE: ...), KELLER_FAILED
 * (memory). */
KellerStatus keller_xml_read(const char *file, xmlDocPtr *doc, KellerError *error);

/* The line of an element or text node, or of the element an attribute belongs to; for messages. */
int keller_xml_line(const void *node);

/* Captures everything that libxml2 would print on this thread between begin and end: the first error is kept, the
 * rest is dropped. For calls into libxml2 outside keller_xml_read (schemas, serialising). */
typedef struct {
    int errors, line;  /* errors seen; line of the first one, 0 if unknown */
    char message[512]; /* of the first one, without a newline */
    xmlStructuredErrorFunc saved;
    void *saved_context;
} KellerXmlCapture;
void keller_xml_capture_begin(KellerXmlCapture *capture);
void keller_xml_capture_end(KellerXmlCapture *capture);
#endif
